"""What the tests of a class share: reports of made-up gradings, who makes them, and a listener to a run."""

from __future__ import annotations

import json
from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path
from typing import Any

from grader import evidence, pipeline
from grader import report as report_room
from grader.classroom.batch import Console
from grader.classroom.class_folder import Record, Status
from grader.classroom.one_grading import Ending, Order
from grader.evidence import Evidence
from grader.scoring import rubric
from grader.scoring.grading import HandIn
from grader.settings import Settings


def report(lost: dict[str, float] | None = None, **more: Any) -> dict[str, Any]:
    """Return a report.json in which all points are reached but those `lost`, by requirement."""
    lost = lost or {}
    requirements = [
        {
            "id": requirement.id,
            "points": requirement.points - lost.get(requirement.id, 0.0),
            "max": requirement.points,
            "outcome": "partial" if requirement.id in lost else "passed",
            "seen": "touched it at 7.3 s" if requirement.id in lost else "",
            "checks": [
                {
                    "id": check.id,
                    "sentence": "stops before the wall",
                    "outcome": "failed" if requirement.id in lost else "passed",
                    "seen": "touched it at 7.3 s\n::error::forged, 100 %",
                    "expected": "no contact",
                    "try": "",
                    "because": "",
                }
                for check in requirement.checks[:1]
            ],
        }
        for requirement in rubric.load(rubric.RUBRIC).requirements
    ]
    return {"submission": "team07.zip", "requirements": requirements, "integrity": [], "wall_seconds": 41.25} | more


def judge(found: Evidence, out: Path, hand_in: HandIn | None = None, *, pictures: bool = False) -> None:
    """Write the evidence of a submission, and the report that the kit makes of it, into the folder `out`."""
    evidence.save(found, out / pipeline.EVIDENCE)
    settings = Settings(rubric=rubric.load(rubric.RUBRIC), cache=out)
    grading = pipeline.judge(out / pipeline.EVIDENCE, settings)
    report_room.write(grading, out, hand_in=hand_in, pictures=pictures)


GRADED = Ending(Status.GRADED, seconds=10.0)


def graded(order: Order) -> Ending:
    """Stand in for a grading in which all points are reached."""
    (Path(order.out) / "report.json").write_text(json.dumps(report()))
    return GRADED


class Workers:
    """Stands in for the processes that grade: `how` makes the ending of an order, in the caller's thread."""

    slots = 2

    def __init__(self, how: Callable[[Order], Ending]) -> None:
        self.how = how
        self.orders: list[str] = []
        self.doing: dict[str, str] = {}
        self.stopped = False

    def submit(self, order: Order) -> Future[Ending]:
        self.orders.append(order.id)
        future: Future[Ending] = Future()
        ending = self.how(order)
        if ending.status is Status.GRADED and not (Path(order.out) / "report.json").exists():
            (Path(order.out) / "report.json").write_text('{"total": 50}')
        future.set_result(ending)
        return future

    def stop(self) -> None:
        self.stopped = True


class Silent(Console):
    """Hears how a run goes on and keeps it."""

    def __init__(self) -> None:
        self.records: list[Record] = []

    def planned(self, *_: Any) -> None:
        pass

    def finished(self, record: Record, *_: Any) -> None:
        self.records.append(record)

    def going_on(self, *_: Any) -> None:
        pass
