"""From checks to points: the rubric, the scorecard, the grading, and the handout made from the rubric."""
