"""X1: the robot slows down before it stops. All that a check can ask of `judge` is in docs/own-course-reference.md."""

from grader.checks.judge import Judge, NotReached


def test_slows_down_before_it_stops(judge: Judge) -> None:
    """Nearer than 0.1 m above `obstacle_detection_threshold` the robot drives no faster than 0.35 m/s."""
    trial = judge.trial("into_the_dead_end")
    judge.call(trial, "set_speed", 0)
    near = [scan for scan in trial.scans if 0.5 < scan.ahead < 0.6]
    if not near:  # whether it drives at all has points of its own
        raise NotReached("the robot did not come near the end of the dead end", "F2")
    for scan in near:
        speed = min(trial.samples, key=lambda sample: abs(sample.t - scan.t)).v
        seen = f"{speed:.2f} m/s at {scan.t:.1f} s, {scan.ahead:.2f} m before the wall"
        judge.expect(speed <= 0.35, seen, "does `safety_margin` slow it down?")
