"""The operator: moves, waits for the picture, looks, corrects, and confirms when content.

Operators adopt this move-and-wait strategy naturally under delay (Ferrell 1965); it consists of
discrete corrective movements (Meyer et al. 1988). Each correction waits for the picture of the
previous one, so no gain and no delay can make this loop unstable. An operator who corrected
continuously would have to keep the crossover below pi / (2 * delay) (McRuer & Jex 1967).
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Generator, Iterator
from dataclasses import dataclass

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.motion.pose_stream import stream_buttons

_TREMOR_WIDTH_Hz, _JOLT_FADES_S = 4.0, 0.2
_SLOWEST_Hz, _PER_SPEED_Hz_s_m, _SPEED_CUTOFF_Hz = 1.0, 100.0, 1.0
_REMEMBERED = 64


@dataclass(frozen=True)
class OperatorParameters:
    """A practised operator with a stylus and a picture. SI units; hand noise is per direction.

    Sources:
    Ferrell, Remote manipulation with transmission delay, IEEE Trans. HFE 6, 1965;
    Meyer et al., Optimality in human motor performance, Psychological Review 95, 1988;
    Burdet, Milner, Quantization of human motions and learning of accurate movements, Biological
    Cybernetics 78, 1998; Card, Moran, Newell, The Psychology of Human-Computer Interaction, 1983;
    Flash, Hogan, The coordination of arm movements, Journal of Neuroscience 5, 1985;
    Schmidt et al., Motor-output variability, Psychological Review 86, 1979;
    Wells et al., Comparison of baseline tremor under various microsurgical conditions, IEEE SMC,
    2013; Riviere, Rader, Khosla, Characteristics of hand motion of eye surgeons, IEEE EMBS, 1997;
    Wolf et al., Understanding the Heisenberg effect of spatial interaction, CHI 2020;
    Casiez, Roussel, Vogel, 1 euro filter, CHI 2012.
    """

    reaction_s: float = 0.24
    """From seeing something to the beginning of a movement (Card, Moran & Newell 1983: 240 ms)."""
    press_s: float = 0.10
    """From the decision to press a button until it closes (same source: 70 ms, plus travel)."""
    shortest_move_s: float = 0.25
    """Duration of a corrective movement (Meyer et al. 1988; Burdet & Milner 1998: 0.2 to 0.3 s)."""
    hand_speed_m_s: float = 0.2
    """Mean speed of a longer movement; unhurried, with the arm on a table."""
    amplitude_noise: float = 0.05
    """Standard deviation of a movement's end, as a share of its length (Schmidt et al. 1979)."""
    undershoot: float = 0.05
    """Share by which a movement is planned too short on purpose (Meyer et al. 1988)."""
    tremor_m: float = 0.05e-3
    """RMS, 8 to 12 Hz (50 to 200 um: Riviere et al.; Wells et al. 2013)."""
    tremor_Hz: float = 10.0
    drift_m: float = 0.08e-3
    """RMS of the slow drift of a hand held still (Riviere, Rader & Khosla 1997: 49 um, eye
    surgeons; Wells et al. 2013: 144 um in space while pointing)."""
    drift_s: float = 1.0
    """Time constant of the drift, which is below 2 Hz (Riviere, Rader & Khosla 1997)."""
    press_jolt_m: float = 0.13e-3
    """RMS motion of the hand when a button closes (133 um while actuating, same source; for
    tracked pointers Wolf et al. 2020)."""
    master_step_m: float = 0.06e-3
    """Resolution of the master (Tremblay, section 2.5.1)."""
    frame_s: float = 0.04
    """Time between two pictures: 25 per second."""
    overview_pixel_m: float = 1.25e-3
    """Pixel size in the picture of the whole grid: 800 mm over 640 pixels."""
    sight_pixel_m: float = 0.19e-3
    """Pixel size in the picture through the sight: 120 mm over 640 pixels, assumed."""
    sight_reach_m: float = 0.05
    """Largest distance at which the target is seen through the sight."""
    tolerance_m: float = 0.75e-3
    """Accepted error per direction, chosen so that the path takes as long as in table 2.2. The
    sight has lines 1 mm thick (section 2.6)."""
    tries: int = 3
    """Corrections after which the operator begins to accept larger errors."""
    impatience: float = 0.25
    """Increase of the accepted error, as a share of `tolerance_m`, per further correction."""
    look_s: float = 0.28
    """Time for which a picture must stand still before it is judged."""
    still_m: float = 0.2e-3
    """Motion that counts as standing still: one pixel, and one scaled step of the master."""
    patience_s: float = 2.0
    """Longest wait for a still picture before the operator judges a moving one."""


@dataclass(frozen=True)
class Station:
    """Devices of the operator in addition to a stylus; the thesis' system had neither."""

    clutch: bool = True
    """Whether a button disconnects hand and robot; it is pressed before looking and confirming."""
    steady: bool = True
    """Whether the hand's position is filtered before it is sent, see `PositionFilter`."""


class HandModel:
    """A hand with minimum-jerk strokes, tremor, drift, and jolts from a button.

    Strokes follow Flash & Hogan (1985); tremor is band-limited noise about `tremor_Hz`, drift is
    first-order noise. `step` advances it by `period_s`; `measured_m` is the master's reading.
    """

    def __init__(
        self, parameters: OperatorParameters, period_s: float, random: np.random.Generator
    ) -> None:
        self._p = parameters
        self._period_s = period_s
        self._random = random
        self._from = np.zeros(2)
        self._way = np.zeros(2)
        self._began_s = self._lasts_s = 0.0
        self._jolt = np.zeros(2)
        self._jolt_closes_s = -math.inf
        self._time_s = 0.0
        turn = complex(-math.pi * _TREMOR_WIDTH_Hz, 2.0 * math.pi * parameters.tremor_Hz)
        self._tremor_step = np.exp(turn * period_s)
        self._tremor_kick = math.sqrt(1.0 - abs(self._tremor_step) ** 2)
        # a complex process of variance 2 has a real part of variance 1
        self._tremor = self._circular()
        self._drift_step = math.exp(-period_s / parameters.drift_s)
        self._drift = random.standard_normal(2)

    def _circular(self) -> np.ndarray[tuple[int], np.dtype[np.complex128]]:
        real, imaginary = self._random.standard_normal((2, 2))
        return np.asarray(real + 1j * imaginary)

    def step(self) -> None:
        """Advance by one period."""
        self._time_s += self._period_s
        self._tremor = self._tremor_step * self._tremor + self._tremor_kick * self._circular()
        kick = math.sqrt(1.0 - self._drift_step**2)
        self._drift = self._drift_step * self._drift + kick * self._random.standard_normal(2)

    @property
    def meant_m(self) -> FloatArray:
        """Intended position of the hand, (2,)."""
        if self._lasts_s == 0.0:
            return self._from
        share = min((self._time_s - self._began_s) / self._lasts_s, 1.0)
        return np.asarray(self._from + self._way * _minimum_jerk(share))

    @property
    def measured_m(self) -> FloatArray:
        """Position measured by the master, (2,), in whole steps."""
        p = self._p
        really = self.meant_m + p.tremor_m * self._tremor.real + p.drift_m * self._drift
        really = really + self._jolt * self._jolt_share()
        return np.asarray(np.round(really / p.master_step_m) * p.master_step_m)

    @property
    def moves(self) -> bool:
        """Whether a stroke is under way."""
        return self._time_s < self._began_s + self._lasts_s

    def stroke(self, way_m: FloatArray) -> None:
        """Begin to move by `way_m` (2,); the stroke is shorter and ends with a random error."""
        p = self._p
        length = float(np.hypot(*way_m))
        noise = p.amplitude_noise * length * self._random.standard_normal(2)
        self._from = self.meant_m
        self._way = (1.0 - p.undershoot) * way_m + noise
        self._began_s = self._time_s
        self._lasts_s = max(p.shortest_move_s, length / p.hand_speed_m_s)

    def press(self) -> None:
        """Begin to press or release a button, which closes or opens after `press_s`."""
        self._jolt = self._p.press_jolt_m * self._random.standard_normal(2)
        self._jolt_closes_s = self._time_s + self._p.press_s

    def _jolt_share(self) -> float:
        left = self._jolt_closes_s - self._time_s
        if left > 0.0:
            return _minimum_jerk(1.0 - min(left / self._p.press_s, 1.0))
        return math.exp(left / _JOLT_FADES_S)


def _minimum_jerk(share: float) -> float:
    return share**3 * (10.0 - 15.0 * share + 6.0 * share**2)


class PositionFilter:
    """The 1-euro filter (Casiez, Roussel & Vogel 2012): a low-pass whose cutoff rises with speed.

    cutoff = 1 Hz + 100 Hz/(m/s)·speed. At rest it blocks most of the tremor of 8 to 12 Hz and of a
    button's jolt; at 0.2 m/s the cutoff is 21 Hz. Call `update` every `period_s`.
    """

    def __init__(self, period_s: float) -> None:
        self._period_s = period_s
        self._last: FloatArray | None = None
        self._speed = np.zeros(2)
        self._filtered = np.zeros(2)

    def update(self, position_m: FloatArray) -> FloatArray:
        """Return the filtered position, (2,), of `position_m` (2,)."""
        if self._last is None:
            self._last = position_m
            self._filtered = position_m.copy()
            return self._filtered
        speed = (position_m - self._last) / self._period_s
        self._last = position_m
        self._speed = self._speed + self._weight(_SPEED_CUTOFF_Hz) * (speed - self._speed)
        cutoff_Hz = _SLOWEST_Hz + _PER_SPEED_Hz_s_m * float(np.hypot(*self._speed))
        self._filtered = self._filtered + self._weight(cutoff_Hz) * (position_m - self._filtered)
        return self._filtered

    def _weight(self, cutoff_Hz: float) -> float:
        return 1.0 / (1.0 + 1.0 / (2.0 * math.pi * cutoff_Hz * self._period_s))


@dataclass(frozen=True)
class CameraImage:
    """One image: the time when it was taken, and the platform's true position (2,) then."""

    taken_s: float
    platform_m: FloatArray


class VisionModel:
    """Sees the images of two cameras `delay_s` after they were taken, in pixels.

    The sight's camera shows the surroundings of the target, the overview the rest (Tremblay,
    section 2.5.1). A judgement is the mean over the pictures looked at, each rounded to whole
    pixels, plus noise of a pixel.
    """

    def __init__(
        self, parameters: OperatorParameters, delay_s: float, random: np.random.Generator
    ) -> None:
        self._p = parameters
        self.delay_s = delay_s
        self._random = random
        self._taken: deque[CameraImage] = deque()
        self._next_s = 0.0
        self.seen: deque[CameraImage] = deque(maxlen=_REMEMBERED)
        """The pictures that have arrived, newest last."""

    def show(self, time_s: float, platform_m: FloatArray) -> None:
        """Take an image if the next one is due, and move arrived images to `seen`."""
        if time_s >= self._next_s - 1e-9:
            self._next_s = time_s + self._p.frame_s
            self._taken.append(CameraImage(time_s, platform_m.copy()))
        while self._taken and self._taken[0].taken_s <= time_s - self.delay_s + 1e-9:
            self.seen.append(self._taken.popleft())

    def since(self, time_s: float) -> list[CameraImage]:
        """Return the seen pictures that were taken at `time_s` or later."""
        return [picture for picture in self.seen if picture.taken_s >= time_s - 1e-9]

    def judge(self, pictures: list[CameraImage], target_m: FloatArray) -> FloatArray:
        """Return the apparent displacement from the platform to the target, (2,)."""
        offs = target_m - np.array([picture.platform_m for picture in pictures])
        near = bool(np.all(np.abs(offs[-1]) < self._p.sight_reach_m))
        pixel = self._p.sight_pixel_m if near else self._p.overview_pixel_m
        seen = (np.round(offs / pixel) * pixel).mean(axis=0)
        return np.asarray(seen + pixel * self._random.standard_normal(2))


@dataclass(frozen=True)
class TargetConfirmation:
    """The confirmation of one target, with its history; times are the operator's."""

    target: int
    begun_s: float
    pressed_s: float
    looked_s: tuple[float, float]
    """Times at which the first and the last judged picture were taken."""
    tries: int
    """Number of movements towards this target."""


class OperatorModel:
    """Leads the platform to `targets_m` (k, 2), one after another; `step` is called each period.

    `scale` is the robot's motion in metres per metre of the hand, `round_trip_s` the delay for
    which the operator has learnt to wait. `step` also steps `hand`; the caller shows the platform
    to `vision`.
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
        """Whether the clutch is pressed now: the hand moves without leading the robot."""
        self.confirmations: list[TargetConfirmation] = []

    @property
    def buttons(self) -> int:
        """The buttons in the format of the set-point stream."""
        return stream_buttons(self.clutch, len(self.confirmations))

    @property
    def target(self) -> int:
        """Number of the current target."""
        return min(len(self.confirmations), len(self._targets) - 1)

    def step(self, time_s: float) -> bool:
        """Act at `time_s`; return False when all targets are confirmed."""
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
        """Wait until the last action is visible and the picture stands still, then judge it."""
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
