"""The operator: moves, waits for the picture, looks, corrects, and confirms when content.

The move-and-wait strategy that operators take up by themselves under delay (Ferrell 1965), out of
discrete corrective movements (Meyer et al. 1988). Since each correction waits for the picture of
the one before, no gain and no delay make this loop unstable; an operator who corrected all the
time would have to keep the crossover frequency below pi / (2 * delay) (McRuer & Jex 1967).
"""

from __future__ import annotations

import math
from collections.abc import Generator, Iterator
from dataclasses import dataclass

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.motion.stream_buttons import stream_buttons
from cdpr_tools.experiment.model.hand_model import HandModel
from cdpr_tools.experiment.model.parameters import OperatorParameters
from cdpr_tools.experiment.model.vision import CameraImage, VisionModel


@dataclass(frozen=True)
class TargetConfirmation:
    """The operator's button at one target, and what led to it; times are the operator's."""

    target: int
    begun_s: float
    pressed_s: float
    looked_s: tuple[float, float]
    """When the first and the last of the pictures judged were taken."""
    tries: int
    """Movements towards this target."""


class OperatorModel:
    """Leads the platform to `targets_m` (k, 2), one after another; `step` is called each period.

    `scale` is metres of the robot for a metre of the hand, `round_trip_s` the delay that the
    operator has learnt to wait for. `hand` is stepped along, the caller shows the
    platform to `vision`.
    """

    def __init__(
        self,
        parameters: OperatorParameters,
        targets_m: FloatArray,
        scale: float,
        round_trip_s: float,
        has_clutch: bool,
        hand: HandModel,
        vision: VisionModel,
    ) -> None:
        self._p = parameters
        self._targets = targets_m
        self._scale = scale
        self._round_trip_s = round_trip_s
        self._has_clutch = has_clutch
        self._hand, self._vision = hand, vision
        self._time_s = 0.0
        self._acted_s = -math.inf
        self._moved = 0
        self._looked = (0.0, 0.0)
        self._script = self._work()
        self.clutch = False
        """Whether it is pressed now: the hand moves without leading."""
        self.confirmations: list[TargetConfirmation] = []

    @property
    def buttons(self) -> int:
        """The buttons as the set-point stream carries them."""
        return stream_buttons(self.clutch, len(self.confirmations))

    @property
    def target(self) -> int:
        """Number of the target that is being led to."""
        return min(len(self.confirmations), len(self._targets) - 1)

    def step(self, time_s: float) -> bool:
        """Do what is to be done at `time_s`; return False when all targets are confirmed."""
        self._time_s = time_s
        self._hand.step()
        return next(self._script, None) is not None

    def _work(self) -> Iterator[bool]:
        for number in range(len(self._targets)):
            yield from self._reach(number)

    def _reach(self, number: int) -> Iterator[bool]:
        target, begun_s, p = self._targets[number], self._time_s, self._p
        self._moved = 0
        while True:
            error = yield from self._look(target)
            good_enough_m = p.tolerance_m * (1.0 + p.impatience * max(0, self._moved - p.tries))
            content = bool(np.all(np.abs(error) <= good_enough_m))
            if content and self.clutch == self._has_clutch:
                break
            if content:
                yield from self._press_clutch(True)
            else:
                if self.clutch:
                    yield from self._press_clutch(False)
                yield from self._move(error)
        yield from self._press_button()
        self.confirmations.append(
            TargetConfirmation(number, begun_s, self._time_s, self._looked, self._moved)
        )
        if self.clutch:
            yield from self._press_clutch(False)

    def _look(self, target: FloatArray) -> Generator[bool, None, FloatArray]:
        """Wait until what was done last is seen and the picture stands still, then judge it."""
        p, vision = self._p, self._vision
        since_s = self._acted_s + self._round_trip_s - vision.delay_s
        longest_s = self._time_s + self._round_trip_s + p.patience_s
        while True:
            pictures = vision.since(max(since_s, self._time_s - vision.delay_s - p.look_s))
            if self._stand_still(pictures) or (pictures and self._time_s > longest_s):
                break
            yield True
        self._looked = (pictures[0].taken_s, pictures[-1].taken_s)
        error = vision.judge(pictures, target)
        yield from self._wait(p.reaction_s)
        return error

    def _stand_still(self, pictures: list[CameraImage]) -> bool:
        p = self._p
        if len(pictures) < round(p.look_s / p.frame_s):
            return False
        still_m = p.still_m + (0.0 if self.clutch else p.master_step_m * self._scale)
        places = np.array([picture.platform_m for picture in pictures])
        return bool(np.all(np.ptp(places, axis=0) < still_m))

    def _move(self, way_m: FloatArray) -> Iterator[bool]:
        self._hand.stroke(way_m / self._scale)
        while self._hand.moves:
            yield True
        self._moved += 1
        self._acted_s = self._time_s

    def _press_clutch(self, pressed: bool) -> Iterator[bool]:
        yield from self._press_button()
        self.clutch = pressed

    def _press_button(self) -> Iterator[bool]:
        """Close or open a button; the hand is jolted."""
        self._hand.press()
        yield from self._wait(self._p.press_s)
        self._acted_s = self._time_s

    def _wait(self, seconds: float) -> Iterator[bool]:
        until_s = self._time_s + seconds - 1e-9
        while self._time_s < until_s:
            yield True
