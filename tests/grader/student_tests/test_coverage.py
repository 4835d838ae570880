"""Which lines of a module no test can be expected to reach: the syntax tree decides, not comments."""

from __future__ import annotations

import pytest

from grader.student_tests.coverage import guarded_lines


@pytest.mark.parametrize(
    "text",
    [
        "if __name__ == '__main__':\n    main()\n",
        'if __name__ == "__main__":  # when run as a script\n    main()\n',
        "if TYPE_CHECKING:\n    from a import B\n",
        "if typing.TYPE_CHECKING:\n    import a\n",
    ],
)
def test_what_runs_only_elsewhere_is_guarded(text: str):
    assert guarded_lines(text) == {1, 2}


@pytest.mark.parametrize(
    "text",
    [
        "def f():  # if TYPE_CHECKING:\n    return 1\n",
        "def f(a='''\nif TYPE_CHECKING:\n'''):\n    return 1\n",
        "class A:\n    if TYPE_CHECKING:\n        import a\n",
        "def f():\n    if __name__ == '__main__':\n        g()\n",
        "if TYPE_CHECKING:\n    def f():\n        return 1\n",
        "if __name__ == '__main__':\n    def f():\n        return 1\n",
        "if __name__ == '__main__':\n    main()\nelse:\n    x = 1\n",
        "if __name__ == '__main__' or True:\n    main()\n",
        "if __name__ != 'x':\n    main()\n",
        "if not TYPE_CHECKING:\n    import a\n",
        "x = 1  # pragma: no cover\n",
        "def (:\n",
        "if __name__ == " + " + ".join(["a"] * 700) + ":\n    pass\n",
    ],
)
def test_what_only_looks_like_a_guard_counts_like_other_code(text: str):
    assert guarded_lines(text) == set()
