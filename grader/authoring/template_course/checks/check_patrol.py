"""B1 and B2: the guard stands until it is sent on patrol."""

from grader.checks.judge import Judge

_ZERO = 1e-6
_SPEED = 0.25


def test_stands_until_it_is_sent(judge: Judge) -> None:
    """Until `patrol` is called, the guard publishes a zero `cmd_vel`."""
    trial = judge.trial("on_and_off", complete=False)
    before = [command for command in trial.commands if command.t <= trial.marks["waited"]]
    judge.expect(bool(before), "no cmd_vel in the first second", "publish from a timer, moving or not")
    fastest = max(abs(command.v) for command in before)
    judge.expect(fastest <= _ZERO, f"cmd_vel of {fastest:.2f} m/s before any call", "begin with `False`")


def test_drives_on_patrol(judge: Judge) -> None:
    """After `patrol` with true the guard drives at `patrol_speed`."""
    trial = judge.trial("on_and_off")
    answer = judge.call(trial, "patrol", 0).response or {}
    judge.expect(answer["success"] is True, "`patrol` answered success = false", "response.success = True")
    start, end = trial.marks["waited"] + 0.5, trial.marks["called back"]
    speeds = [command.v for command in trial.commands if start < command.t <= end]
    judge.expect(bool(speeds), "no cmd_vel on patrol", "publish from a timer, moving or not")
    worst = max(speeds, key=lambda v: abs(v - _SPEED))
    judge.expect(abs(worst - _SPEED) <= 0.01, f"cmd_vel of {worst:.2f} m/s on patrol", "read `patrol_speed`")


def test_stands_when_it_is_called_back(judge: Judge) -> None:
    """After `patrol` with false the guard stands still within half a second."""
    trial = judge.trial("on_and_off")
    judge.call(trial, "patrol", 1)
    last = [command.v for command in trial.commands if command.t > trial.marks["called back"] + 0.5]
    seen = f"cmd_vel of {max(last, key=abs, default=0.0):.2f} m/s half a second after `patrol` with false"
    judge.expect(bool(last) and all(abs(v) <= _ZERO for v in last), seen, "take `request.data` as it is")
