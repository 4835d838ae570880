"""Write the notebooks as an nbgrader assignment: check cells whose points nbgrader counts, and the settings they need.

nbgrader takes a test cell that raises nothing for passed, and a number as its last value for partial credit. `check`
raises nothing, so the instructor's version of each check cell ends in its points, as a hidden test.
"""

from __future__ import annotations

from pathlib import Path

import nbformat
from nbformat import NotebookNode

from grader.authoring import notebook_source
from grader.scoring.rubric import Rubric

ASSIGNMENT = "notebooks"
"""The assignment's name. `begin` puts the workspace beside a folder of this name: one for each student."""

CONFIG = '''\
"""Settings of nbgrader for the ROS 2 course; written by `python -m grader.authoring.book nbgrader`."""

c = get_config()  # noqa: F821 (nbgrader gives it)
c.CourseDirectory.course_id = "ros2-course"
c.ClearSolutions.enabled = False  # exercises ship as stubs that run; nbgrader's own would raise
c.ExecutePreprocessor.timeout = 600  # seconds a cell; the first build of the interfaces is the longest
'''


def write(names: list[str], rubric: Rubric, course: Path, notebooks: Path = notebook_source.NOTEBOOKS) -> list[Path]:
    """Write the notebooks `names` and the settings into the nbgrader course folder `course`; return the files."""
    folder = course / "source" / ASSIGNMENT
    (folder / "pictures").mkdir(parents=True, exist_ok=True)
    written = [course / "nbgrader_config.py"]
    written[0].write_text(CONFIG)
    for name in names:
        target = folder / f"{name}.ipynb"
        notebook = instructors(name, notebook_source.read(name, rubric, notebooks), notebooks)
        target.write_text(nbformat.writes(notebook, version=4) + "\n", encoding="utf-8")
        written.append(target)
    for picture in sorted((notebooks / "pictures").glob("*.png")):
        copy = folder / "pictures" / picture.name
        copy.write_bytes(picture.read_bytes())
        written.append(copy)
    return written


def instructors(name: str, notebook: NotebookNode, notebooks: Path = notebook_source.NOTEBOOKS) -> NotebookNode:
    """Return the notebook with the points as a hidden test in each check cell that counts."""
    held = notebook_source.counted(name, notebook, notebooks)
    for cell in notebook.cells:
        if counted := held.get(cell["id"]):
            call = cell.source.strip().removesuffix(";")
            points = f"sum(float(found.points) for found in answer.answers if found.id in {counted})"
            cell.source = f"answer = {call}\nanswer\n### BEGIN HIDDEN TESTS\n{points}\n### END HIDDEN TESTS"
    return notebook
