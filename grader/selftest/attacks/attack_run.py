"""Carry out attacks on this machine: grade the package with and without each, and say whether it was kept in."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path

from grader import pipeline, report
from grader.errors import GraderError, SubmissionError
from grader.evidence import Flag
from grader.report import console
from grader.scoring.grading import Grading
from grader.scoring.scorecard import Outcome
from grader.selftest.attacks.attack import Attack, Filled, copy
from grader.selftest.attacks.honeytokens import Scene, scene
from grader.selftest.attacks.weaknesses import WEAK

Points = dict[str, float]

# An attack on the build runs code, so it shares no build tree, and compiles everything: minutes on a busy machine.
_BUILD_SECONDS = 900.0


@dataclass(frozen=True)
class Carried:
    """How an attack came out. `faults` says in words what should not have happened; without any it was contained."""

    attack: Attack
    without: Points = field(default_factory=dict)
    points: Points = field(default_factory=dict)
    flags: tuple[Flag, ...] = ()
    faults: tuple[str, ...] = ()
    seconds: float = 0.0
    refused: str = ""

    @property
    def contained(self) -> bool:
        """Whether the outcome is the right one."""
        return not self.faults


def run(
    attacks: Iterable[Attack],
    reference: Path,
    settings: pipeline.Settings,
    done: Callable[[Carried], None] = lambda _carried: None,
) -> list[Carried]:
    """Carry out the attacks one after the other, each told to `done` as it ends, and return how they came out.

    Raises:
        GraderError: the package without any attack cannot be graded.
    """
    attacks = list(attacks)
    honest = _Honest(reference, settings, attacks)
    carried = []
    for each in attacks:
        started = time.monotonic()
        result = Carried(each) if each.no_door else _carry_out(each, reference, settings, honest)
        carried.append(replace(result, seconds=time.monotonic() - started))
        done(carried[-1])
    return carried


class _Honest:
    """What packages with a weakness and without an attack earn; graded once, for all that the attacks need."""

    def __init__(self, reference: Path, settings: pipeline.Settings, attacks: list[Attack]) -> None:
        self._reference, self._settings = reference, settings
        self._needs: dict[str, set[str]] = {}
        for each in attacks:
            self._needs.setdefault(each.weak, set()).update(each.needs)
        self._points: dict[str, Points] = {}

    def points(self, weak: str) -> Points:
        if weak not in self._points:
            with tempfile.TemporaryDirectory(prefix="attack-") as folder:
                package = copy(self._reference, Path(folder))
                for change in WEAK[weak]:
                    change(package)
                needs = tuple(sorted(self._needs[weak]))
                patient = replace(self._settings, requirements=needs, build_seconds=_BUILD_SECONDS)
                grading = pipeline.grade(package, Path(folder) / "out", patient)
            if not grading.evidence.build.ok:
                raise GraderError(
                    f"The package without an attack does not build here: {grading.evidence.build.log_tail}"
                )
            if unjudged := [s.requirement.id for s in grading.unjudged]:
                raise GraderError(f"The package without an attack has an error of ours in {', '.join(unjudged)}.")
            self._points[weak] = _points(grading)
        return self._points[weak]


def _carry_out(each: Attack, reference: Path, settings: pipeline.Settings, honest: _Honest) -> Carried:
    without = {name: points for name, points in honest.points(each.weak).items() if name in each.needs}
    with tempfile.TemporaryDirectory(prefix="attack-") as folder, scene() as there:
        room = Path(folder)
        handed_in = _prepare(each, reference, room, there.filled)
        chosen = replace(settings, requirements=each.needs, build_seconds=each.build_seconds or _BUILD_SECONDS)
        try:
            grading = pipeline.grade(handed_in, there.results, chosen)
        except SubmissionError as error:
            faults = [] if each.refused and each.refused in str(error) else [f"it was refused: {error}"]
            return Carried(each, without, faults=(*faults, *there.damage()), refused=str(error))
        except GraderError as error:
            return Carried(each, without, faults=(f"the grader gave up: {error}", *there.damage()))
        except Exception as error:  # a traceback of ours is what attacks are looked for
            return Carried(each, without, faults=(f"{type(error).__name__}: {error}", *there.damage()))
        faults = [*_wrong_points(each, grading, without), *_wrong_signs(each, grading, there), *there.damage()]
        return Carried(each, without, _points(grading), tuple(grading.evidence.flags), tuple(faults))


def _prepare(each: Attack, reference: Path, room: Path, filled: Filled) -> Path:
    package = copy(reference, room)
    for change in (*WEAK[each.weak], *each.changes):
        change(package)
    filled.folder(package)
    return each.pack(package, room) if each.pack else package


def _wrong_points(each: Attack, grading: Grading, without: Points) -> list[str]:
    faults = []
    if each.refused:
        faults.append("it was graded and should have been refused")
    for score in grading.scorecard.requirements:
        name = score.requirement.id
        if name not in each.needs:
            continue
        if score.outcome is Outcome.ERROR:
            seen = next((result.seen for result in score.results if result.outcome is Outcome.ERROR), "")
            faults.append(f"{name} could not be judged: {seen[:300]}")
        if score.points > without[name] + 1e-6:
            faults.append(f"{name} rose from {without[name]:g} to {score.points:g} points")
        if score.points < without[name] - 1e-6 and name not in each.costs:
            faults.append(f"{name} fell from {without[name]:g} to {score.points:g} points")
    return faults


def _wrong_signs(each: Attack, grading: Grading, there: Scene) -> list[str]:
    faults = []
    if each.flag and not any(each.flag in flag.kind for flag in grading.evidence.flags):
        faults.append(f"no integrity flag of the kind {each.flag!r}")
    report.write(grading, there.results, pictures=False)
    if told := there.told(there.results):
        faults.append(f"the secret is told in {', '.join(told)}")
    texts = [path.read_text(errors="replace") for path in (there.results / "evidence").rglob("*.json")]
    if each.proof and not any(each.proof in text or each.proof in text.replace("\\", "") for text in texts):
        faults.append(f"it was not carried out: {each.proof!r} stands nowhere in the evidence")
    page = (there.results / "report.html").read_text()
    if "<script>alert" in page or "<img src=x" in page:
        faults.append("markup of the submission stands in report.html")
    shown = console.render(grading)
    if "\x1b" in shown or "\u202e" in shown:
        faults.append("escape sequences of the submission reach the console")
    if any(line.strip().startswith(("::", "##[")) for line in shown.splitlines()):
        faults.append("a line of the console begins like a CI command")
    return faults


def _points(grading: Grading) -> Points:
    return {score.requirement.id: score.points for score in grading.scorecard.requirements}
