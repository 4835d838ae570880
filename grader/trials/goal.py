"""One goal of the navigation action, from its client's side."""

from __future__ import annotations

import math
from typing import Any

from action_msgs.msg import GoalStatus

from grader import evidence
from grader.course import GoalFields
from grader.trials.messages import fill
from grader.trials.node_under_test import NodeUnderTest

_STATUS = {
    GoalStatus.STATUS_SUCCEEDED: "succeeded",
    GoalStatus.STATUS_CANCELED: "canceled",
    GoalStatus.STATUS_ABORTED: "aborted",
}
ANSWER_WALL_S = 3.0  # how long the clock stands still for an answer before time goes on
_SILENT_S = 0.6
_FEEDBACK_KEPT = 20_000  # a flood must not fill our memory


class SentGoal:
    """A goal that was sent: its progress and, in the end, its facts. Position in the odom frame, in metres."""

    def __init__(self, node: NodeUnderTest, fields: GoalFields, x: float, y: float, tolerance: float) -> None:
        self._node, self._fields = node, fields
        self._sent_t = node.bridge.time
        self._x, self._y, self._tolerance = x, y, tolerance
        self._feedback: list[list[float]] = []
        self._ended_t = math.nan
        self._cancel_t = math.nan
        self._cancel: Any = None
        self._handle: Any = None
        self._result: Any = None
        self.problem: evidence.Reason | None = None
        pose = {"position": {"x": float(x), "y": float(y)}, "orientation": {"w": 1.0}}
        goal = fill(node.action_type.Goal(), {fields.target: pose, fields.tolerance: float(tolerance)})
        sending = node.action.send_goal_async(goal, feedback_callback=self._take_feedback)
        sending.add_done_callback(self._take_answer)

    @property
    def answered(self) -> bool:
        """Return whether the node has accepted or rejected the goal."""
        return self._handle is not None

    @property
    def accepted(self) -> bool:
        """Return whether the node has accepted the goal."""
        return self._handle is not None and bool(self._handle.accepted)

    @property
    def ended(self) -> bool:
        """Return whether the result has come, or never will because the goal was rejected."""
        return self._result is not None or (self.answered and not self.accepted)

    @property
    def running(self) -> bool:
        """Return whether the node is working on the goal."""
        return self.accepted and not self.ended

    @property
    def silent(self) -> bool:
        """Return whether feedback is overdue: the contract asks for some every half second."""
        last = self._feedback[-1][0] if self._feedback else self._sent_t
        return self.running and self._node.bridge.time - last > _SILENT_S

    @property
    def result(self) -> Any:
        """Return the result message, None until it has come."""
        return None if self._result is None else self._result.result

    def cancel(self) -> None:
        """Ask the node to cancel the goal; in lockstep, with the clock standing still until it answers.

        Else it would be chance whether the request reaches the node before or after the next tick.
        """
        self._cancel_t = self._node.bridge.time
        if self.accepted:
            self._cancel = self._handle.cancel_goal_async()
            if self._node.bridge.pace == "lockstep":
                self._node.bridge.spin_until(self._cancel.done, ANSWER_WALL_S)

    def facts(self) -> evidence.Goal:
        """Return what has become of the goal so far."""
        result = self.result
        place = None if result is None else getattr(result, self._fields.final).position
        status = "unfinished" if result is None else _STATUS.get(self._result.status, "unfinished")
        if self.answered and not self.accepted:
            status = "rejected"
        cancel_done = self._cancel is not None and self._cancel.done()
        return evidence.Goal(
            t=self._sent_t,
            x=self._x,
            y=self._y,
            tolerance=self._tolerance,
            accepted=self.accepted,
            status=status,
            success=None if result is None else bool(getattr(result, self._fields.success)),
            final_x=math.nan if place is None else float(place.x),
            final_y=math.nan if place is None else float(place.y),
            ended_t=self._ended_t,
            cancel_t=self._cancel_t,
            cancel_accepted=bool(self._cancel.result().goals_canceling) if cancel_done else None,
            feedback=self._feedback,
            problem=self.problem,
        )

    def _take_answer(self, future: Any) -> None:
        self._handle = future.result()
        if self._handle.accepted:
            self._handle.get_result_async().add_done_callback(self._take_result)

    def _take_result(self, future: Any) -> None:
        self._result = future.result()
        self._ended_t = self._node.bridge.time

    def _take_feedback(self, message: Any) -> None:
        pose = self._node.bridge.simulator.pose
        true_distance = math.hypot(self._x - pose.x, self._y - pose.y)
        self._node.bridge.note_feedback()
        if len(self._feedback) < _FEEDBACK_KEPT:
            said = float(getattr(message.feedback, self._fields.remaining))
            self._feedback.append([self._node.bridge.time, said, true_distance])
