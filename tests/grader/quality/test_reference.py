"""The reference gets every point of Q1 to Q4, the README's words, its report and package.xml."""

from __future__ import annotations

import pytest
from helpers.quality_examples import judged, untouched

from grader.checks import (
    check_docstrings,
    check_habits,
    check_handed_in,
    check_package_xml,
    check_readme,
    check_structure,
    check_style,
)

FROM_TEXT = [
    check_style.test_ament_flake8_finds_nothing,
    check_docstrings.test_public_things_have_docstrings,
    check_docstrings.test_docstrings_follow_ament_pep257,
    check_structure.test_layout_matches_the_contract,
    check_structure.test_no_function_is_too_complex,
    check_structure.test_conversions_are_in_utils_and_used,
    check_structure.test_no_block_is_repeated,
    check_habits.test_no_bare_except_print_or_mutable_default,
    check_habits.test_callbacks_do_not_sleep,
    check_habits.test_contract_numbers_are_parameters,
    check_habits.test_public_functions_are_annotated,
    check_readme.test_readme_says_what_and_how,
    check_readme.test_interface_table_agrees,
    check_handed_in.test_test_results_match_the_tests,
    check_package_xml.test_package_xml_is_valid_format_3,
    check_package_xml.test_licence_has_its_spdx_name,
    check_package_xml.test_build_type_matches_the_package,
    check_package_xml.test_every_package_used_is_declared,
]


@pytest.mark.parametrize("check", FROM_TEXT, ids=lambda check: check.__name__)
def test_the_reference_has_full_marks(check):
    assert judged(check, untouched()).share == 1.0, judged(check, untouched()).seen


@pytest.mark.parametrize("check", FROM_TEXT, ids=lambda check: check.__name__)
def test_text_that_was_not_read_is_our_fault(check):
    from grader.checks.judge import Unjudged

    with pytest.raises(Unjudged):
        judged(check, None)
