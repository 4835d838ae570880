"""What holds for all tests: who runs them, in which order, and what is said of the time they take."""

from helpers.sharing import (
    pytest_collection,
    pytest_collection_finish,
    pytest_collection_modifyitems,
    pytest_configure,
    pytest_report_header,
    pytest_runtest_logreport,
    pytest_runtest_setup,
    pytest_terminal_summary,
    pytest_xdist_auto_num_workers,
    pytest_xdist_make_scheduler,
)
from hypothesis import settings

settings.register_profile("kit", deadline=None)  # a limit by the clock fails on a busy machine
settings.load_profile("kit")
