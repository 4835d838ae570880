"""Call the package's own functions behind a wall, and bring back what they return. Data only, no verdicts."""

from grader.conversions.ask import ask_conversions

__all__ = ["ask_conversions"]
