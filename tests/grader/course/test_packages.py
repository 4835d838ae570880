"""What a submission can import."""

from __future__ import annotations

from grader import KIT
from grader.course import handout, load
from grader.scoring import rubric


def test_the_handout_lists_what_a_package_may_import():
    found = load(KIT / "grader" / "authoring" / "template_course")
    page = handout.render(rubric.load(found.rubric), found)
    assert "`numpy` 2." in page
    assert "`yaml` (pyyaml" in page
    assert "`geometry_msgs`" in page
    assert "launch" not in page, "the course has no launch files"
