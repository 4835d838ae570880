"""Ctrl-C in a block in which it must not interrupt."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator

import pytest

from grader.ros2.commands.graph import interrupt_later


@pytest.fixture
def ctrl_c() -> Iterator[None]:
    """Ctrl-C as at a terminal: in tests started in the background it is ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def test_ctrl_c_is_delayed_to_the_end_of_the_block(ctrl_c):
    done = []

    def press_and_continue():
        with interrupt_later() as check:
            check()
            os.kill(os.getpid(), signal.SIGINT)
            done.append("the rest of the block")

    with pytest.raises(KeyboardInterrupt):
        press_and_continue()
    assert done
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
