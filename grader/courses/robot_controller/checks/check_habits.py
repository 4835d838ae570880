"""Q4: numbers that are parameters."""

from grader.checks.check_habits import expect_parameters
from grader.checks.judge import Judge

from .settings_effect import without_effect


def test_contract_numbers_are_parameters(judge: Judge) -> None:
    """The numbers that the contract names as parameters are declared as parameters and read from them."""
    trial = judge.evidence.trials.get("other_settings")  # which the package's text alone is judged without
    tried = trial is not None and trial.ready and not trial.script_error
    found = without_effect(trial).items() if trial is not None and tried else ()
    expect_parameters(judge, [(name, f"robot_controller: {seen}") for name, seen in found])
