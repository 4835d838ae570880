"""Write the notebooks as an nbgrader assignment: check cells with points that nbgrader counts, and its settings.

To nbgrader a test cell passes if it raises nothing, and a number as its last value is partial credit. `check` raises
nothing, so the instructor's version of each check cell ends with its points, as a hidden test.
"""

from __future__ import annotations

from pathlib import Path

import nbformat

from grader.authoring import notebook_source
from grader.scoring.rubric import Rubric

ASSIGNMENT = "notebooks"
"""The assignment's name. `begin` creates the workspace beside a folder of this name: one for each student."""

CONFIG = '''\
"""Settings of nbgrader for the ROS 2 course; written by `python -m grader.authoring.book nbgrader`."""

c = get_config()  # noqa: F821 (nbgrader defines it)
c.CourseDirectory.course_id = "ros2-course"
c.ClearSolutions.enabled = False  # exercises ship as stubs that run; nbgrader's stubs would raise
c.ExecutePreprocessor.timeout = 600  # seconds for one cell; the first build of the interfaces takes longest
'''


def write(names: list[str], rubric: Rubric, course: Path, notebooks: Path = notebook_source.NOTEBOOKS) -> list[Path]:
    """Write the notebooks `names` and the settings into the nbgrader course folder `course`; return the files."""
    folder = course / "source" / ASSIGNMENT
    (folder / "pictures").mkdir(parents=True, exist_ok=True)
    written = [course / "nbgrader_config.py"]
    written[0].write_text(CONFIG)
    for name in names:
        target = folder / f"{name}.ipynb"
        notebook = notebook_source.read(name, rubric, notebooks)
        scored = notebook_source.scored_requirements(name, notebook, notebooks)
        for cell in notebook.cells:
            if requirements := scored.get(cell["id"]):
                call = cell.source.strip().removesuffix(";")
                points = f"sum(float(found.points) for found in answer.answers if found.id in {requirements})"
                cell.source = f"answer = {call}\nanswer\n### BEGIN HIDDEN TESTS\n{points}\n### END HIDDEN TESTS"
        target.write_text(nbformat.writes(notebook, version=4) + "\n", encoding="utf-8")
        written.append(target)
    for picture in sorted((notebooks / "pictures").glob("*.png")):
        copy = folder / "pictures" / picture.name
        copy.write_bytes(picture.read_bytes())
        written.append(copy)
    return written
