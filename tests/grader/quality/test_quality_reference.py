"""The reference gets every point of Q1 to Q4, the README's words, its report and package.xml."""

from __future__ import annotations

import pytest
from quality_examples import judged, untouched

from grader.checks import test_package_xml, test_quality

FROM_TEXT = [
    test_quality.test_ament_flake8_finds_nothing,
    test_quality.test_public_things_have_docstrings,
    test_quality.test_docstrings_keep_ament_pep257,
    test_quality.test_layout_is_the_contracts,
    test_quality.test_no_function_is_too_complex,
    test_quality.test_conversions_are_in_utils_and_used,
    test_quality.test_no_block_stands_twice,
    test_quality.test_no_bare_except_print_or_mutable_default,
    test_quality.test_callbacks_do_not_sleep,
    test_quality.test_contract_numbers_are_parameters,
    test_quality.test_public_functions_are_annotated,
    test_quality.test_readme_says_what_and_how,
    test_quality.test_interface_table_agrees,
    test_quality.test_test_results_are_of_own_tests,
    test_package_xml.test_it_is_valid_format_3,
    test_package_xml.test_licence_has_its_spdx_name,
    test_package_xml.test_build_type_is_true,
    test_package_xml.test_every_package_used_is_declared,
]


@pytest.mark.parametrize("check", FROM_TEXT, ids=lambda check: check.__name__)
def test_the_reference_has_full_marks(check):
    assert judged(check, untouched()).share == 1.0, judged(check, untouched()).seen


@pytest.mark.parametrize("check", FROM_TEXT, ids=lambda check: check.__name__)
def test_text_that_was_not_read_is_our_fault(check):
    from grader.checks.judge import Unjudged

    with pytest.raises(Unjudged):
        judged(check, None)
