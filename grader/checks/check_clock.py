"""I7: the nodes follow /clock."""

from grader.checks import motion
from grader.checks.judge import Judge


def test_timers_and_stamps_follow_the_clock(judge: Judge) -> None:
    """With `use_sim_time` the timers and stamps follow `/clock`."""
    for name in ("standing_clock", "standing_clock_processor"):
        trial = judge.trial(name)
        held = int(trial.choices["held"])
        judge.expect(trial.pace == "lockstep", f"{trial.node} publishes while the clock is stopped", _TRY)
        seen = f"{trial.node} published {held} messages in 1 s of wall time while the clock was stopped"
        judge.expect(held <= 1, seen, _TRY)
    trial = judge.trial("standing_clock")
    hertz = motion.rate(trial.commands, 0.5, trial.samples[-1].t)
    judge.expect(bool(trial.commands), "no cmd_vel under simulated time", _TRY)
    judge.expect(hertz > 2.0, f"cmd_vel at {hertz:.1f} Hz of simulated time", _TRY)
    fusion = judge.trial("fusion", complete=False)
    for message in (m for m in fusion.messages if m.topic == "sensor_fusion_data"):
        stamp = message.data["header"]["stamp"]
        t = float(stamp["sec"]) - 100.0 + float(stamp["nanosec"]) * 1e-9
        judge.expect(abs(t - message.t) < 1.0, f"a stamp of {t:.1f} s at {message.t:.1f} s of simulated time", _TRY)


_TRY = "create_timer and self.get_clock() follow /clock; time.time(), time.sleep() and threading.Timer do not"
