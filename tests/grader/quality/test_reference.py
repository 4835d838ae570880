"""The reference gets every point of Q1 to Q4, the README's words, its report and package.xml."""

from __future__ import annotations

import pytest
from helpers.quality_examples import judged, untouched

from grader.checks import check_package_xml, check_quality

FROM_TEXT = [
    check_quality.test_ament_flake8_finds_nothing,
    check_quality.test_public_things_have_docstrings,
    check_quality.test_docstrings_keep_ament_pep257,
    check_quality.test_layout_is_the_contracts,
    check_quality.test_no_function_is_too_complex,
    check_quality.test_conversions_are_in_utils_and_used,
    check_quality.test_no_block_stands_twice,
    check_quality.test_no_bare_except_print_or_mutable_default,
    check_quality.test_callbacks_do_not_sleep,
    check_quality.test_contract_numbers_are_parameters,
    check_quality.test_public_functions_are_annotated,
    check_quality.test_readme_says_what_and_how,
    check_quality.test_interface_table_agrees,
    check_quality.test_test_results_are_of_own_tests,
    check_package_xml.test_it_is_valid_format_3,
    check_package_xml.test_licence_has_its_spdx_name,
    check_package_xml.test_build_type_is_true,
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
