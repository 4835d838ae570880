"""A course: everything of one assignment, read once from a folder and passed down. No judgement, no tools."""

from grader.course.model import Course, Functions, Node, Parameter, role
from grader.course.reader import kits_own, load

__all__ = ["Course", "Functions", "Node", "Parameter", "kits_own", "load", "role"]
