"""A course: everything of one assignment, read once from a folder and passed down. No judgement, no tools."""

from grader.course.model import Course, Functions, GoalFields, Node, Parameter, launch_stem, role
from grader.course.reader import find, kits_own, load, name_of, named, passed_over
