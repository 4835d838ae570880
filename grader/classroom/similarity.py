"""A zip of a class's Python for Dolos and JPlag, which find what is alike. Nothing is run."""

from __future__ import annotations

import zipfile
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from pathlib import Path

from grader import python_ast
from grader.classroom import discovery
from grader.classroom.class_folder import ClassFolder
from grader.course import named
from grader.errors import SubmissionError
from grader.host import tempdir
from grader.intake.submission import open_submission
from grader.quality import source_files
from grader.sandbox import untrusted
from grader.sanitize import one_line

GIVEN = "_given"


def archive(folder: ClassFolder, given: Mapping[str, str], path: Path, progress: Callable[[str], None]) -> list[str]:
    """Write a folder for each submission and one for what the course gives; return remarks on what is not in it.

    Each has one file: these tools read no text that Python cannot read, nor two files of one name.
    """
    facts = folder.facts()
    course = named(facts.course)
    present = [entry for entry in facts.entries if not entry.absent]
    notes = [f"{entry.id} is left out: the present sources do not have it." for entry in facts.entries if entry.absent]
    texts = {GIVEN: given}
    with ExitStack() as stack:
        sources = {entry.source or facts.source for entry in present}
        roots = {source: stack.enter_context(discovery.opened(folder.located(source))).folder for source in sources}
        scratch = stack.enter_context(tempdir.folder("similar"))
        for entry in present:
            progress(f"reading {entry.id}")
            source = roots[entry.source or facts.source] / entry.path
            try:
                package = open_submission(source, scratch / entry.id, course).package
            except SubmissionError as error:
                notes.append(f"{entry.id} is left out: {one_line(error.what)}")
                continue
            found = source_files.find(package, course)
            read = {f.path: None if f.problem else untrusted.read_python(package / f.path) for f in found}
            texts[entry.id] = {name: text for name, text in read.items() if text is not None and python_ast.parse(text)}
            notes += [f"{entry.id} is without {one_line(name)}." for name in read if name not in texts[entry.id]]
            if discovery.content_hash(source) != entry.content:
                notes.append(f"{entry.id} is as it is now; it is not what was graded.")
            tempdir.remove(scratch / entry.id)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as made:
        for name, files in texts.items():
            parts = (f"# {one_line(file)}\n{text}" for file, text in sorted(files.items()))
            made.writestr(f"{name}/{name}.py", "\n\n".join(parts))
    return notes
