"""The zip of a class's Python that Dolos and JPlag read."""

from __future__ import annotations

import zipfile
from pathlib import Path

from submissions.edits import REFERENCE

from grader import cli

DRIVER = (REFERENCE / REFERENCE.name / "driver.py").read_text()


def test_the_command_writes_what_dolos_and_jplag_read(class_of_four, tmp_path: Path, monkeypatch, capsys):
    """boek and team07 hand in the same package; the class names its source as it was given."""
    folder = class_of_four()
    for name in ("boek", "team07"):
        package = tmp_path / "export.zip" / f"{name}.zip" / REFERENCE.name
        package.mkdir(parents=True)
        (package / "package.xml").write_text((REFERENCE / "package.xml").read_text())
        (package / "driver.py").write_text(DRIVER)
        (package / "broken.py").write_text("def f(:\n  '''")
    monkeypatch.chdir(tmp_path)
    assert cli.main(["similar", str(folder.path), "--out", "class.zip"]) == 0
    printed = capsys.readouterr().out
    assert "boek is without broken.py." in printed
    assert "boek is as it is now; it is not what was graded." in printed
    with zipfile.ZipFile(tmp_path / "class.zip") as made:
        assert set(made.namelist()) == {"boek/boek.py", "team07/team07.py", "_given/_given.py"}
        assert made.read("boek/boek.py").decode() == f"# driver.py\n{DRIVER}"
        assert "class" in made.read("_given/_given.py").decode()
