"""Run along the path of targets, with a recorded robot on its simulator or with a perfect one.

Tremblay (thesis), section 2.6: 10 targets on a pattern of 600 x 300 mm, the right half first,
ending at the start. The text does not say which points of the pattern figure 2.8 uses. This
module assumes its corners, the points on its edges a quarter of the width from the middle, and its
centre.
In space the pattern stands upright along x, in the middle of the workspace's depth.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cdpr_profiles import Robot
from cdpr_profiles.platform import Platform
from cdpr_rt.arrays import FloatArray
from cdpr_rt.motion.pose_stream import CLUTCH, confirmation
from cdpr_rt.motion.trajectory import approach
from cdpr_rt.service.stream_packet import Standing
from cdpr_tools.errors import BadInputError, WorkFailedError
from cdpr_tools.teleop import experiment_operator
from cdpr_tools.trials.directions import Directions, platform_of
from cdpr_tools.trials.recorded import Recorded
from cdpr_tools.trials.run import TrialRun, trial_run

PACKET_S: Final = 0.02
"""Time between two packets: 50 per second (Tremblay, section 2.5.1: 30 to 60)."""
SHARE_THERE: Final = 0.05
"""Share of the round trip for the way to the robot; the rest is the picture's delay (section 2.7).
"""
LONGEST_S = 900.0
"""A run that takes longer is aborted."""
_MARK = "path"
"""Name of the mark for each run; it holds the condition and the operator's actions."""
_PLAYED_S: Final = 0.3
"""Time to wait until the last received packet is played and recorded."""
_PERIOD_S = 0.005
"""Cycle of the perfect robot."""

WIDTH_M: Final = 0.6
HEIGHT_M: Final = 0.3

PLACES: Final[Mapping[str, tuple[float, float]]] = MappingProxyType(
    {"A": (0.0, 0.5), "B": (-0.2, 0.25), "C": (0.2, 0.75)}
)
"""Centre of the pattern, as shares of the workspace: from the middle, and above the floor."""

_PATTERN: Final = (
    (0.25, 0.5), (0.5, 0.5), (0.5, -0.5), (0.25, -0.5), (0.0, 0.0),
    (-0.25, 0.5), (-0.5, 0.5), (-0.5, -0.5), (-0.25, -0.5), (0.0, 0.0),
)  # fmt: skip


def plane_of(k: int) -> tuple[int, int]:
    """Return the two of a platform's k coordinates that span the pattern: x, and the upward one."""
    return 0, k - 1


def place_of(directions: Directions, in_plane_m: FloatArray) -> FloatArray:
    """Return the platform's place (d,) at a point (2,) of the pattern's plane."""
    place = directions.middle.copy()
    place[list(plane_of(directions.k))] = in_plane_m
    return place


def centre_m(robot: Robot, place: str) -> FloatArray:
    """Return the position (2,) of the pattern's centre at a place; it is also start and end.

    Raises BadInputError if the robot's workspace has no room for the pattern there.
    """
    directions = Directions.of(platform_of(robot))
    if place not in PLACES:
        raise BadInputError(f"place: value {place!r}; allowed: {', '.join(PLACES)}")
    plane = list(plane_of(directions.k))
    low, high = directions.low_m[plane], directions.high_m[plane]
    across, up = PLACES[place]
    size = high - low
    centre = np.array([0.5 * (low[0] + high[0]) + across * size[0], low[1] + up * size[1]])
    half = 0.5 * np.array([WIDTH_M, HEIGHT_M])
    if np.any(centre - half < low) or np.any(centre + half > high):
        raise BadInputError(
            f"{robot.path}: [platform] workspace_min_m, workspace_max_m: "
            f"{low.tolist()} to {high.tolist()} m; place {place} of the pattern needs "
            f"{(centre - half).tolist()} to {(centre + half).tolist()} m"
        )
    return centre


def targets_m(centre: FloatArray) -> FloatArray:
    """Return the targets of the pattern about `centre` (2,) in order, (10, 2)."""
    return np.asarray(centre + np.array(_PATTERN) * (WIDTH_M, HEIGHT_M))


TICK = np.dtype(
    [
        ("time_s", "f8"), ("cycle", "i8"), ("truth_m", "f8", (2,)), ("hand_m", "f8", (2,)),
        ("buttons", "i4"), ("target", "i4"),
    ]
)  # fmt: skip
"""Record of each packet: the operator's time, the robot's cycle and true position then, the hand's
position as sent, its buttons, and the current target."""


@dataclass(frozen=True)
class Condition:
    """One cell of the experiment; `repeat` counts its runs."""

    place: str
    scale: float
    round_trip_s: float
    repeat: int

    @property
    def name(self) -> str:
        """Name of the condition, for files."""
        return f"{self.place}-{self.scale:g}-{1e3 * self.round_trip_s:.0f}ms-{self.repeat}"

    def random(self, seed: int) -> tuple[np.random.Generator, np.random.Generator]:
        """Return the generators of hand and vision, equal for the same condition and seed."""
        key = (ord(self.place), round(1e3 * self.scale), round(1e3 * self.round_trip_s))
        return (
            np.random.default_rng([seed, *key, self.repeat, 1]),
            np.random.default_rng([seed, *key, self.repeat, 2]),
        )


class PerfectRobot:
    """A platform that follows the hand within its speed and acceleration, without any error.

    As in the program `pose`, each movement of the hand moves the target by `scale` times its
    length. A movement that begins with the clutch pressed does not count. All remaining errors come
    from the operator.
    """

    def __init__(self, platform: Platform, begin_m: FloatArray) -> None:
        self._target = begin_m.copy()
        self._hand: FloatArray | None = None
        self._leads = False
        self._speed = np.full(2, platform.speed_m_s)
        self._acceleration = np.full(2, platform.acceleration_m_s2)
        self._position = begin_m.copy()
        self._velocity, self._slope = np.zeros(2), np.zeros(2)
        self.track_m: list[tuple[float, float]] = [(float(begin_m[0]), float(begin_m[1]))]
        """The platform's position in each cycle."""

    @property
    def cycle(self) -> int:
        """Number of the current cycle."""
        return len(self.track_m) - 1

    @property
    def now_s(self) -> float:
        """Time of the robot."""
        return self.cycle * _PERIOD_S

    @property
    def truth_m(self) -> FloatArray:
        """Position of the platform, (2,)."""
        return self._position

    def advance(self, until_s: float) -> None:
        """Let time pass."""
        for _ in range(math.ceil((until_s - 1e-9) / _PERIOD_S) - self.cycle):
            approach(
                self._target,
                self._speed,
                self._acceleration,
                _PERIOD_S,
                self._position,
                self._velocity,
                self._slope,
            )
            self.track_m.append((self._position[0], self._position[1]))

    def send(self, _sent_s: float, hand_m: FloatArray, scale: float, buttons: int) -> None:
        """Receive a packet that arrives now."""
        if self._hand is not None and self._leads:
            self._target += scale * (hand_m - self._hand)
        self._hand = hand_m
        self._leads = not buttons & CLUTCH


class RobotPlant:
    """The robot of a run: packets go to the daemon's session manager, cycles over the bus."""

    def __init__(self, run: TrialRun) -> None:
        self._rig = run.rig
        self._plane = list(plane_of(run.directions.k))
        self._stay = run.stay
        self._hand = run.rig.stream.sender()

    @property
    def now_s(self) -> float:
        """Bus time."""
        return self._rig.now_s

    @property
    def cycle(self) -> int:
        """Number of the current cycle."""
        return self._rig.cycle

    @property
    def truth_m(self) -> FloatArray:
        """True position of the platform at the last SYNC, in the pattern's plane, (2,)."""
        return np.array(self._rig.truth()["position_m"][self._plane])

    def advance(self, until_s: float) -> None:
        """Run cycles; raises WorkFailedError if the motion ends meanwhile."""
        cycles = round((until_s - self._rig.now_s) / self._rig.period_s)
        if cycles > 0:
            self._stay(cycles * self._rig.period_s)

    def send(self, sent_s: float, hand_m: FloatArray, scale: float, buttons: int) -> None:
        """Pass a packet to the session manager; raises WorkFailedError if it is rejected."""
        moved = np.zeros(3)
        moved[self._plane] = hand_m
        packet = self._hand.packet(sent_s, moved.tolist(), scale, buttons)
        answer = self._rig.stream.take(packet)
        standing = None if answer is None else self._hand.answer_of(answer).standing
        if standing is not Standing.ACCEPTED:
            raise WorkFailedError(f"the robot rejected a packet of the stream: {standing}")


class _Link:
    """Packets under way to the robot, and the cycles in which confirmations arrived."""

    def __init__(self, plant: RobotPlant | PerfectRobot, delay_s: float, scale: float) -> None:
        self._plant, self._delay_s, self._scale = plant, delay_s, scale
        self._under_way: deque[tuple[float, FloatArray, int]] = deque()
        self.confirmed_cycles: list[int] = []

    def send(self, hand_m: FloatArray, buttons: int) -> None:
        self._under_way.append((self._plant.now_s, hand_m, buttons))

    def advance(self, until_s: float) -> None:
        """Let time pass and deliver the packets that arrive."""
        while self._under_way and self._under_way[0][0] + self._delay_s <= until_s + 1e-9:
            sent_s, hand_m, buttons = self._under_way.popleft()
            self._plant.advance(sent_s + self._delay_s)
            self._plant.send(sent_s, hand_m, self._scale, buttons)
            if confirmation(buttons) > len(self.confirmed_cycles):
                self.confirmed_cycles.append(self._plant.cycle)
        self._plant.advance(until_s)


def run_trial(
    plant: RobotPlant | PerfectRobot,
    condition: Condition,
    targets_m: FloatArray,
    parameters: experiment_operator.OperatorParameters,
    station: experiment_operator.Station,
    seed: int,
) -> tuple[NDArray[np.void], list[dict[str, Any]]]:
    """Let an operator lead `plant`, which stands at the path's start, along `targets_m` (k, 2).

    Returns (ticks,) of TICK, and for each target: its number `target`, the `cycle` in which its
    confirmation arrived, the operator's times `begun_s` and `pressed_s`, the `look_cycles` of the
    first and the last judged picture, and `tries`. Raises WorkFailedError if the path takes too
    long.
    """
    for_hand, for_eyes = condition.random(seed)
    there_s = SHARE_THERE * condition.round_trip_s
    hand = experiment_operator.HandModel(parameters, PACKET_S, for_hand)
    vision = experiment_operator.VisionModel(parameters, condition.round_trip_s - there_s, for_eyes)
    operator = experiment_operator.OperatorModel(
        parameters, targets_m, condition.scale, condition.round_trip_s, station.clutch, hand, vision
    )
    steady = experiment_operator.PositionFilter(PACKET_S) if station.steady else None
    link = _Link(plant, there_s, condition.scale)
    begin_s, ticks = plant.now_s, []
    time_s, busy = 0.0, True
    while busy or len(link.confirmed_cycles) < len(targets_m):
        if time_s > LONGEST_S:
            raise WorkFailedError(
                f"{condition.name}: target {operator.target + 1} was not confirmed: the path took "
                f"more than {LONGEST_S:g} s"
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
    points = [
        {
            "target": confirmed.target,
            "cycle": cycle,
            "begun_s": confirmed.begun_s,
            "pressed_s": confirmed.pressed_s,
            "look_cycles": [int(table["cycle"][round(s / PACKET_S)]) for s in confirmed.looked_s],
            "tries": confirmed.tries,
        }
        for confirmed, cycle in zip(operator.confirmations, link.confirmed_cycles, strict=True)
    ]
    return table, points


@dataclass(frozen=True)
class ExperimentSettings:
    """Settings of an experiment, stored beside its results."""

    robot: str
    plant: str | None
    commissioned: str | None
    compensated: bool
    seed: int
    operator: experiment_operator.OperatorParameters
    station: experiment_operator.Station
    places: tuple[str, ...]
    scales: tuple[float, ...]
    round_trips_s: tuple[float, ...]
    repeats: int

    def sessions(self) -> dict[str, tuple[Condition, ...]]:
        """Return the runs of each session, in random order, by the session's name."""
        chance = np.random.default_rng(self.seed)
        return {
            f"{place}-{1e3 * round_trip_s:.0f}ms-{repeat}": tuple(
                Condition(place, self.scales[k], round_trip_s, repeat)
                for k in chance.permutation(len(self.scales))
            )
            for repeat in range(1, self.repeats + 1)
            for round_trip_s in self.round_trips_s
            for place in self.places
        }


def run_session(
    settings: ExperimentSettings, conditions: Sequence[Condition], folder: Path
) -> None:
    """Start the robot once and run the path under each condition; record all in `folder`.

    Raises WorkFailedError and BadInputError.
    """
    with trial_run(
        settings.robot,
        folder,
        plant=None if settings.plant is None else Path(settings.plant),
        seed=settings.seed,
        advance=lambda _: None,
        commissioned=None if settings.commissioned is None else Path(settings.commissioned),
        compensated=settings.compensated,
    ) as run:
        plant = RobotPlant(run)
        for condition in conditions:
            _run_path(run, plant, settings, condition, folder)


def _run_path(
    run: TrialRun,
    plant: RobotPlant,
    settings: ExperimentSettings,
    condition: Condition,
    folder: Path,
) -> None:
    centre = centre_m(run.rig.robot, condition.place)
    run.go(place_of(run.directions, centre))
    run.stay(1.0)
    run.rig.program("pose", stream=True)
    first, targets = plant.cycle, targets_m(centre)
    ticks, points = run_trial(
        plant, condition, targets, settings.operator, settings.station, settings.seed
    )
    run.stay(_PLAYED_S)
    np.save(folder / f"{condition.name}.npy", ticks)
    run.mark(
        _MARK,
        condition=asdict(condition),
        first_cycle=first,
        targets_m=targets.tolist(),
        points=points,
    )


Points = NDArray[np.void]
POINT: Final = np.dtype(
    [
        ("place", "U1"), ("scale", "f8"), ("round_trip_s", "f8"), ("repeat", "i4"),
        ("target", "i4"), ("error_m", "f8", (2,)), ("judged_m", "f8", (2,)),
        ("hand_m", "f8", (2,)), ("robot_m", "f8", (2,)), ("following_m", "f8", (2,)),
        ("begun_s", "f8"), ("pressed_s", "f8"), ("tries", "i4"),
    ]
)  # fmt: skip
"""A confirmed target. `error_m` is the true position minus the target when the confirmation was
recorded. It is the sum of three parts: `judged_m`, the true error in the pictures that the
operator accepted; `hand_m`, the later motion of the set-point, which the hand leads; `robot_m`,
the further motion of the platform. `following_m` is the true position minus the set-point, which
the operator sees and corrects."""


def points_of_session(folder: Path) -> Points:
    """Return the targets confirmed in a session, (k,) of POINT, from its recording alone.

    Raises BadInputError and WorkFailedError for missing or unfinished files.
    """
    recorded = Recorded(folder)
    parts = [_points_of_path(recorded, path) for path in recorded.marked(_MARK)]
    return np.concatenate(parts) if parts else np.zeros(0, POINT)


def _points_of_path(recorded: Recorded, path: dict[str, Any]) -> Points:
    rows = slice(recorded.row(path["first_cycle"]), recorded.row(path["cycle"]) + 1)
    numbers = confirmation(recorded.cycles["stream_buttons"][rows].astype(np.int64))
    found = rows.start + 1 + np.flatnonzero(np.diff(numbers) > 0)
    entries = path["points"]
    if len(found) != len(entries):
        raise WorkFailedError(
            f"{recorded.folder}: the cycles contain {len(found)} confirmed targets, "
            f"but the events list {len(entries)}"
        )
    plane = list(plane_of(recorded.directions.k))
    looks = [[recorded.row(cycle) for cycle in entry["look_cycles"]] for entry in entries]
    places_m = recorded.true_m[:, plane], recorded.setpoint_m[:, plane]
    return _points(path["condition"], path["targets_m"], entries, found, looks, *places_m)


def points_of_perfect_robot(
    platform: Platform,
    centre_m: FloatArray,
    condition: Condition,
    operator: experiment_operator.OperatorParameters,
    station: experiment_operator.Station,
    seed: int,
) -> Points:
    """Return the points of the same operator, hand and vision with a perfect robot."""
    robot, targets = PerfectRobot(platform, centre_m), targets_m(centre_m)
    _, entries = run_trial(robot, condition, targets, operator, station, seed)
    cycles, looks = ([entry[key] for entry in entries] for key in ("cycle", "look_cycles"))
    true_m = np.array(robot.track_m)
    return _points(asdict(condition), targets, entries, cycles, looks, true_m, true_m)


def _points(
    condition: dict[str, Any],
    targets_m: ArrayLike,
    entries: Sequence[dict[str, Any]],
    confirmed: Iterable[int],
    looks: Iterable[Sequence[int]],
    true_m: FloatArray,
    setpoint_m: FloatArray,
) -> Points:
    """Return the points of a run from its true positions `true_m` and set-points `setpoint_m`.

    Both have a row (2,) for each cycle. `confirmed` are the rows in which confirmations arrived,
    `looks` the rows of the first and the last judged picture.
    """
    points = np.zeros(len(entries), POINT)
    for point, entry, row, (first, last) in zip(points, entries, confirmed, looks, strict=True):
        for name in ("place", "scale", "round_trip_s", "repeat"):
            point[name] = condition[name]
        for name in ("target", "begun_s", "pressed_s", "tries"):
            point[name] = entry[name]
        look = slice(first, last + 1)
        target = np.asarray(targets_m)[entry["target"]]
        point["error_m"] = true_m[row] - target
        point["judged_m"] = true_m[look].mean(axis=0) - target
        point["hand_m"] = setpoint_m[row] - setpoint_m[look].mean(axis=0)
        point["robot_m"] = point["error_m"] - point["judged_m"] - point["hand_m"]
        point["following_m"] = true_m[row] - setpoint_m[row]
    return points
