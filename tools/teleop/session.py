"""One hand leads one robot: set-points out, answers in, until one of them ends."""

from __future__ import annotations

import math
import select
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from cdpr_rt.core.states import LoopState
from cdpr_rt.motion.pose_stream import stream_buttons
from cdpr_rt.service.stream_client import StreamClient
from cdpr_rt.service.stream_packet import Standing, StreamAnswer
from cdpr_tools.teleop.input_device import End, InputDevice, InputSample

RATE_Hz: Final = 60.0
_GREET_S: Final = 3.0
_SILENCE_S: Final = 2.5
"""Longer than the right to move lasts without renewal; after this time the robot holds."""
_TAKEN_AWAY_S: Final = 0.4
_STILL_m: Final = 2e-5
_STILL_S: Final = 0.6
_ARRIVE_S: Final = 15.0
_UNSEEN_S: Final = 1.0
"""Longest time without a position of the robot; longer than received data wait to be played."""
_MOST_KEPT: Final = 36_000
_NEVER_ANSWERED: Final = ": its stream cannot be reached there"
_WHY_NOT: Final = {
    Standing.BUSY: "another sender holds the set-point stream",
    Standing.NO_RIGHT: "the right to move has expired, or another client has it",
}


@dataclass(frozen=True)
class Confirmation:
    """State at a confirmation of the hand; places are (x, y) or (x, y, z) in m, or nan."""

    number: int
    time_s: float
    hand_m: tuple[float, ...]
    pose_m: tuple[float, ...]
    setpoint_m: tuple[float, ...]
    round_trip_s: float


class TeleopSession:
    """Leads through `stream` with `device` at `scale`, while program number `program` runs.

    The hand leads from the first set-point that the robot has accepted; its earlier motion
    is ignored.
    """

    def __init__(
        self,
        stream: StreamClient,
        device: InputDevice,
        scale: float,
        program: int,
        coordinates: int = 2,
    ) -> None:
        self.stream, self.device, self.scale = stream, device, scale
        self.coordinates = coordinates
        self.hand = InputSample()
        self.leading = False
        self.confirmations: list[Confirmation] = []
        self.round_trips_s: deque[float] = deque(maxlen=_MOST_KEPT)
        """Round trips of the newest answers, the last one at the end."""
        self.moved_m = 0.0
        """Largest distance of the set-point from where the hand began to lead; a change of the
        quaternion counts as if in metres."""
        self._led_from: tuple[float, ...] = ()
        self._program = program
        self._begin_s = self._heard_s = self._fine_s = time.monotonic()

    @property
    def answer(self) -> StreamAnswer | None:
        """Return the robot's newest answer."""
        return self.stream.state

    @property
    def silent_s(self) -> float:
        """Return the time since the last answer."""
        return time.monotonic() - self._heard_s

    @property
    def pose_m(self) -> tuple[float, ...]:
        """Return the platform's position as the robot reports it."""
        return self._place(None if self.answer is None else self.answer.pose)

    @property
    def turn_rad(self) -> tuple[float, ...]:
        """Return the platform's rotation vector, or its angle in a plane."""
        pose = () if self.answer is None else self.answer.pose
        vector = [math.nan] * 3
        if pose:
            sign, size = math.copysign(1.0, pose[3]), math.hypot(*pose[4:])
            angle = 2.0 * math.atan2(size, abs(pose[3]))
            vector = [sign * (angle / size if size else 0.0) * part for part in pose[4:]]
        return tuple(vector) if self.coordinates > 2 else (vector[2],)

    @property
    def setpoint_m(self) -> tuple[float, ...]:
        """Return the platform's present set-point."""
        return self._place(None if self.answer is None else self.answer.pose_setpoint)

    def teleoperate(self, stop_requested: Callable[[], bool]) -> End:
        """Teleoperate until the device, the robot or the user ends it; return why."""
        self._begin_s = self._heard_s = self._fine_s = next_s = time.monotonic()
        end: End | None = None
        while end is None:
            end = self._turn(time.monotonic())
            if stop_requested():
                return End("ended on request")
            next_s = max(next_s + 1.0 / RATE_Hz, time.monotonic())
            self._listen(next_s)
        return self._arrive(end, stop_requested) if end.arrive else end

    def figures(self) -> dict[str, Any]:
        """Return counts of set-points and answers, delays in both directions, and confirmations."""
        trips = np.array(self.round_trips_s)
        quantiles = np.quantile(trips, (0.5, 0.99, 1.0)) if trips.size else np.full(3, np.nan)
        return {
            "sent": self.stream.sent,
            "answered": self.stream.answered,
            "round_trip_ms": dict(zip(("p50", "p99", "max"), 1e3 * quantiles, strict=True)),
            "confirmations": [vars(one) for one in self.confirmations],
        }

    def _turn(self, now_s: float) -> End | None:
        if not self.leading:
            self.leading = self._runs()
        if self.leading:
            before, self.hand = self.hand, self.device.read(now_s)
            for number in range(before.confirmed + 1, self.hand.confirmed + 1):
                self._confirm(number, now_s)
        self._send()
        return self._lost(now_s) or self.hand.end

    def _send(self) -> None:
        hand = self.hand
        buttons = stream_buttons(hand.clutch or bool(hand.trouble), hand.confirmed)
        self.stream.send(hand.position_m, hand.quaternion, self.scale, buttons)

    def _listen(self, until_s: float) -> None:
        """Receive answers when they arrive, so that the delay is that of the network."""
        poll = select.poll()
        poll.register(self.stream.fileno(), select.POLLIN)
        while (left_s := until_s - time.monotonic()) > 0.0:
            if not poll.poll(math.ceil(1e3 * left_s)):
                return
            for _ in self.stream.receive():
                self._heard_s = time.monotonic()
                self.round_trips_s.append(self.stream.round_trip_s)
                if self.leading and math.isfinite(self._setpoint[0]):
                    self._led_from = self._led_from or self._setpoint
                    moved_m = math.dist(self._led_from, self._setpoint)
                    self.moved_m = max(self.moved_m, moved_m)

    def _runs(self) -> bool:
        """Return whether the robot accepts set-points and its program follows them."""
        answer = self.answer
        if answer is None or answer.standing in _WHY_NOT:
            return False
        return (answer.state, answer.program) == (LoopState.ACTIVE, self._program)

    def _lost(self, now_s: float) -> End | None:
        """Return why the robot does not follow, if that has lasted."""
        timeout_s = _SILENCE_S if self.leading else _GREET_S
        if now_s - self._heard_s > timeout_s:
            hint = "" if self.stream.answered else _NEVER_ANSWERED
            return End(f"the robot has not answered for {timeout_s:g} s{hint}", failed=True)
        if self._runs():
            self._fine_s = now_s
        elif now_s - self._fine_s > (_TAKEN_AWAY_S if self.leading else _GREET_S):
            standing = None if self.answer is None else self.answer.standing
            why = "" if standing is None else _WHY_NOT.get(standing, "")
            since = " any longer" if self.leading else ""
            return End(why or f"the robot does not follow the stream{since}", failed=True)
        return None

    def _confirm(self, number: int, now_s: float) -> None:
        self.confirmations.append(
            Confirmation(
                number,
                now_s - self._begin_s,
                self.hand.position_m[: self.coordinates],
                self.pose_m,
                self.setpoint_m,
                self.stream.round_trip_s,
            )
        )

    def _arrive(self, end: End, stop_requested: Callable[[], bool]) -> End:
        """Keep the hand in place until the robot has reached its last target.

        Returns `end`, or the reason if something ended it earlier.
        """
        begin_s = since_s = time.monotonic()
        place = self._setpoint
        while not stop_requested():
            self._send()
            now_s = time.monotonic()
            self._listen(now_s + 1.0 / RATE_Hz)
            if not math.dist(place, self._setpoint) < _STILL_m:
                since_s, place = now_s, self._setpoint
            lost = self._lost(now_s)
            if lost is not None:
                return lost
            known = math.isfinite(place[0])
            rests = now_s - since_s > _STILL_S if known else now_s - begin_s > _UNSEEN_S
            if rests and self._runs():
                return end
            if now_s - begin_s > _ARRIVE_S:
                return End(f"the robot has not come to rest within {_ARRIVE_S:g} s", failed=True)
        return End("ended on request")

    @property
    def _setpoint(self) -> tuple[float, ...]:
        """Return the set-point's position in m and quaternion."""
        return (math.nan,) * 7 if self.answer is None else self.answer.pose_setpoint

    def _place(self, pose: tuple[float, ...] | None) -> tuple[float, ...]:
        return ((math.nan,) * 3 if pose is None else pose)[: self.coordinates]
