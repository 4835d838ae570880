"""What is read on import is read for the tests that use it, found by names."""

from __future__ import annotations

from pathlib import Path
from textwrap import dedent

import pytest

from grader.student_tests.source_users import users_of

MODULE = """
    from pathlib import Path
    import pytest

    TEXT = Path('a.py').read_text()
    LINES = {}
    for number, line in enumerate(Path('a.py').read_text().splitlines()):
        LINES[number] = line
    LONG = [line for line in TEXT.splitlines() if len(line) > 99]


    def words():
        return TEXT.split()


    @pytest.fixture(scope='module')
    def tree():
        return compile(Path('a.py').read_text(), 'a', 'exec')


    def test_behaves():
        assert 1 + 1 == 2


    def test_reads():
        assert 'braking' in TEXT


    def test_reads_through_a_helper():
        assert words()


    def test_reads_what_was_made_of_it():
        assert not LONG


    def test_uses_the_loops_lines():
        assert LINES[0]


    def test_uses_the_fixture(tree):
        assert tree


    @pytest.mark.parametrize('word', words())
    def test_goes_through_the_words(word):
        assert word


    class TestBoth:
        def test_behaves(self):
            assert 1 + 1 == 2

        def test_reads(self):
            assert 'braking' in TEXT


    class TestPrepared:
        def setup_method(self):
            self.text = TEXT

        def test_uses_self(self):
            assert self.text
"""
OF_TEXT = {
    "test_reads", "test_reads_through_a_helper", "test_reads_what_was_made_of_it", "test_goes_through_the_words[a]",
    "TestBoth::test_reads", "TestPrepared::test_uses_self",
}  # fmt: skip
TESTS = [
    "test_behaves", "test_reads", "test_reads_through_a_helper", "test_reads_what_was_made_of_it",
    "test_uses_the_loops_lines", "test_uses_the_fixture", "test_goes_through_the_words[a]", "TestBoth::test_behaves",
    "TestBoth::test_reads", "TestPrepared::test_uses_self",
]  # fmt: skip


def users(folder: Path, statement: str, text: str = MODULE, where: str = "test/test_it.py", conftest: str = ""):
    """Return who uses what the line with this statement has read, without the module's path."""
    (folder / "test").mkdir()
    (folder / "test/test_it.py").write_text(dedent(text))
    (folder / "test/conftest.py").write_text(dedent(conftest))
    lines = (folder / where).read_text().splitlines()
    line = next((number for number, words in enumerate(lines, 1) if statement in words), 10**6)
    tests = [f"test/test_it.py::{name}" for name in TESTS]
    found = users_of(folder / "test/test_it.py", where, line, tests)
    return None if found is None else {name.partition("::")[2] for name in found}


@pytest.mark.parametrize(
    ("statement", "expected"),
    [
        ("TEXT =", OF_TEXT),
        ("for number", {"test_uses_the_loops_lines"}),
        ("return compile", {"test_uses_the_fixture"}),
        ("'braking' in TEXT", {"test_reads"}),
        ("self.text = TEXT", {"TestPrepared::test_uses_self"}),
    ],
)
def test_only_the_tests_that_use_it_count(tmp_path: Path, statement: str, expected: set[str]):
    assert users(tmp_path, statement) == expected


def test_a_fixture_of_conftest_counts_for_the_tests_that_ask_for_it(tmp_path: Path):
    conftest = "import pytest\n\nTEXT2 = open('a.py').read()\n\n\n@pytest.fixture\ndef tree():\n    return TEXT2\n"
    text = MODULE.replace("    @pytest.fixture(scope='module')\n    def tree():", "    def other():")
    assert users(tmp_path, "TEXT2 =", text, "test/conftest.py", conftest) == {"test_uses_the_fixture"}


@pytest.mark.parametrize(
    "added",
    [
        "\n    if 'braking' not in TEXT:\n        raise SystemExit\n",
        "\n    assert 'braking' in TEXT\n",
        "\n    pytestmark = pytest.mark.skipif('braking' not in TEXT, reason='changed')\n",
        "\n    @pytest.fixture(autouse=True)\n    def same():\n        assert TEXT\n",
    ],
)
def test_what_decides_about_every_test_counts_for_all(tmp_path: Path, added: str):
    assert users(tmp_path, "TEXT =", MODULE + added) is None


@pytest.mark.parametrize("where", ["test/helper.py", "", "/etc/passwd"])
def test_of_any_other_file_it_cannot_be_told(tmp_path: Path, where: str):
    (tmp_path / "test").mkdir()
    (tmp_path / "test/test_it.py").write_text(dedent(MODULE))
    assert users_of(tmp_path / "test/test_it.py", where, 5, ["test/test_it.py::test_reads"]) is None
