"""The helpers over `ast`: what cannot be parsed, names, arguments, tests."""

from __future__ import annotations

import ast
import contextlib
import threading

import pytest

from grader.python_ast import argument, called, first_line, is_test, parse


@pytest.mark.parametrize(
    "text",
    ["def f(:\n", "x = '\0'\n", b"x = '\xff'\n", "x = " + "9" * 5000, "x = " + "-" * 100_000 + "1"],
    ids=["syntax", "NUL", "not UTF-8", "5000 digits", "too deep"],
)
def test_what_cannot_be_parsed_is_none(text: str | bytes):
    assert parse(text) is None


def test_a_stray_escape_gives_no_warning():
    """Warnings are errors in this run."""
    assert parse("x = '\\d'\n") is not None


@pytest.mark.parametrize(
    ("call", "found"),
    [("f(1, 2)", 2), ("f(1, b=3)", 3), ("f(1)", None), ("f(*x, 2)", None), ("f(1, *x)", None), ("f(1, c=3)", None)],
)
def test_an_argument_is_found_by_position_or_name(call: str, found: int | None):
    node = ast.parse(call, mode="eval").body
    assert isinstance(node, ast.Call)
    value = argument(node, 1, "b")
    assert (value.value if isinstance(value, ast.Constant) else None) == found


@pytest.mark.parametrize(("text", "name"), [("a.b.c()", "c"), ("c()", "c"), ("f()()", ""), ("c", "")])
def test_a_call_is_known_by_its_last_name(text: str, name: str):
    assert called(ast.parse(text, mode="eval").body) == name


def test_a_fixture_is_not_a_test():
    tests = ast.parse("def test_a(): 1\nasync def test_b(): 1\n@pytest.fixture(scope='module')\ndef test_node(): 1\n")
    assert [is_test(node) for node in tests.body] == [True, True, False]


def test_a_decorated_function_begins_at_its_decorator():
    assert [first_line(node) for node in ast.parse("@a\n@b\ndef f(): 1\nx = 1\n").body] == [1, 4]


def test_two_threads_never_parse_at_the_same_time(monkeypatch: pytest.MonkeyPatch):
    """A grading parses in several threads, and ended with "AST constructor recursion depth mismatch" now and then."""
    both_inside = threading.Barrier(2, timeout=0.2)
    met = []

    def parse_slowly(text: str) -> ast.Module:
        with contextlib.suppress(threading.BrokenBarrierError):
            both_inside.wait()
            met.append(text)
        return ast.Module([], [])

    monkeypatch.setattr(ast, "parse", parse_slowly)
    threads = [threading.Thread(target=parse, args=(text,)) for text in ("a", "b")]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert met == []
