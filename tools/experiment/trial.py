"""One run along the path: an operator, the link there and the picture back, and a robot."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from cdpr_rt.arrays import FloatArray
from cdpr_rt.motion.stream_buttons import confirmation
from cdpr_tools.errors import WorkFailedError
from cdpr_tools.experiment.model.hand_model import HandModel, PositionFilter
from cdpr_tools.experiment.model.operator_model import OperatorModel
from cdpr_tools.experiment.model.parameters import OperatorParameters, Station
from cdpr_tools.experiment.model.plants import TeleoperatedRobot
from cdpr_tools.experiment.model.vision import VisionModel

PACKET_S: Final = 0.02
"""Between two packets: 50 a second (Tremblay, section 2.5.1: 30 to 60)."""
SHARE_THERE: Final = 0.05
"""Of the round trip, on the way to the robot; the rest is the picture's (section 2.7)."""
_LONGEST_S: Final = 900.0

TICK = np.dtype(
    [
        ("time_s", "f8"), ("cycle", "i8"), ("truth_m", "f8", (2,)), ("hand_m", "f8", (2,)),
        ("buttons", "i4"), ("target", "i4"),
    ]
)  # fmt: skip
"""What is kept of each packet: the operator's time, the robot's cycle and true position then, the
hand's position as it is sent, its buttons, and the target it leads to."""


@dataclass(frozen=True)
class Condition:
    """One cell of the experiment; `repeat` counts its runs."""

    place: str
    scale: float
    round_trip_s: float
    repeat: int

    @property
    def name(self) -> str:
        """Its name, for files."""
        return f"{self.place}-{self.scale:g}-{1e3 * self.round_trip_s:.0f}ms-{self.repeat}"

    def random(self, seed: int) -> tuple[np.random.Generator, np.random.Generator]:
        """Return the randomness of hand and vision, the same for the same condition and seed."""
        key = (ord(self.place), round(1e3 * self.scale), round(1e3 * self.round_trip_s))
        return (
            np.random.default_rng([seed, *key, self.repeat, 1]),
            np.random.default_rng([seed, *key, self.repeat, 2]),
        )


@dataclass(frozen=True)
class Trial:
    """What one run gave: `ticks` (k,) of TICK, and a row for each target, see `points`."""

    condition: Condition
    targets_m: FloatArray
    ticks: NDArray[np.void]
    points: tuple[dict[str, Any], ...]
    """For each target: its number `target`, `cycle` at which its confirmation arrived, `begun_s`
    and `pressed_s` of the operator, `look_cycles` at which the first and the last picture judged
    were taken, `tries`."""


class _Link:
    """Packets under way to the robot, and what it did with them."""

    def __init__(self, plant: TeleoperatedRobot, delay_s: float, scale: float) -> None:
        self._plant, self._delay_s, self._scale = plant, delay_s, scale
        self._under_way: deque[tuple[float, FloatArray, int]] = deque()
        self.confirmed_cycles: list[int] = []

    def send(self, hand_m: FloatArray, buttons: int) -> None:
        self._under_way.append((self._plant.now_s, hand_m, buttons))

    def advance(self, until_s: float) -> None:
        """Let time pass, and packets arrive in it."""
        while self._under_way and self._under_way[0][0] + self._delay_s <= until_s + 1e-9:
            sent_s, hand_m, buttons = self._under_way.popleft()
            self._plant.advance(sent_s + self._delay_s)
            self._plant.send(sent_s, hand_m, self._scale, buttons)
            if confirmation(buttons) > len(self.confirmed_cycles):
                self.confirmed_cycles.append(self._plant.cycle)
        self._plant.advance(until_s)


def run_trial(
    plant: TeleoperatedRobot,
    condition: Condition,
    targets_m: FloatArray,
    parameters: OperatorParameters,
    station: Station,
    seed: int,
) -> Trial:
    """Let an operator lead `plant` along `targets_m` (k, 2); raises WorkFailedError if it ends not.

    The plant has to be ready to be led, its platform at the path's begin.
    """
    for_hand, for_eyes = condition.random(seed)
    there_s = SHARE_THERE * condition.round_trip_s
    hand = HandModel(parameters, PACKET_S, for_hand)
    vision = VisionModel(parameters, condition.round_trip_s - there_s, for_eyes)
    operator = OperatorModel(
        parameters, targets_m, condition.scale, condition.round_trip_s, station.clutch, hand, vision
    )
    steady = PositionFilter(PACKET_S) if station.steady else None
    link = _Link(plant, there_s, condition.scale)
    begin_s, ticks = plant.now_s, []
    time_s, busy = 0.0, True
    while busy or len(link.confirmed_cycles) < len(targets_m):
        if time_s > _LONGEST_S:
            raise WorkFailedError(
                f"{condition.name}: target {operator.target + 1} was not confirmed: the path took "
                f"more than {_LONGEST_S:g} s"
            )
        vision.show(time_s, plant.truth_m)
        busy = busy and operator.step(time_s)
        target, buttons = operator.target, operator.buttons
        hand_m = hand.measured_m if steady is None else steady.update(hand.measured_m)
        ticks.append((time_s, plant.cycle, plant.truth_m.copy(), hand_m, buttons, target))
        link.send(hand_m, buttons)
        time_s = len(ticks) * PACKET_S
        link.advance(begin_s + time_s)
    table = np.array(ticks, TICK)
    return Trial(condition, targets_m, table, _points(operator, link, table))


def _points(
    operator: OperatorModel, link: _Link, ticks: NDArray[np.void]
) -> tuple[dict[str, Any], ...]:
    """Return what is kept of each confirmation; times become cycles of the robot."""
    cycles = ticks["cycle"]
    return tuple(
        {
            "target": confirmed.target,
            "cycle": cycle,
            "begun_s": confirmed.begun_s,
            "pressed_s": confirmed.pressed_s,
            "look_cycles": [int(cycles[round(at / PACKET_S)]) for at in confirmed.looked_s],
            "tries": confirmed.tries,
        }
        for confirmed, cycle in zip(operator.confirmations, link.confirmed_cycles, strict=True)
    )
