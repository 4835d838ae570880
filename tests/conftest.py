"""What holds for all tests: who runs them, and in which order."""

from helpers.sharing import (
    pytest_collection,
    pytest_collection_finish,
    pytest_collection_modifyitems,
    pytest_configure,
    pytest_runtest_setup,
    pytest_xdist_auto_num_workers,
    pytest_xdist_make_scheduler,
)
from hypothesis import settings

settings.register_profile("kit", deadline=None)  # a limit by the clock fails on a busy machine
settings.load_profile("kit")
