"""The questions about a new cable robot, with defaults that follow from earlier answers."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_profiles import ProfileError, Robot, Winch, load_robot, load_winch
from cdpr_profiles.platform import Platform, WIDEST_m

# Kinds of cable robots that `cdpr robot new` describes; each is modelled on a shipped robot.

KINDS = {
    "planar-3": "in a plane, x and y: 3 cables, and the platform turns freely",
    "planar-4": "in a plane, x, y and angle: 4 cables, one more than directions",
    "point-4": "a point in space, x, y, z: 4 cables from above",
    "suspended-6": "a platform in space on 6 cables from above, the fewest for its 6 directions",
    "suspended-8": "a platform in space on 8 cables from above: larger workspace and angles",
    "spatial-8": "a platform in space, 8 cables from above and below: fully constrained",
}
"""By name: a description, and the reason for the number of cables."""
SKETCH = r"""
planar-3       planar-4       point-4        suspended-6, -8   spatial-8
o         o    o         o    o         o    o  o     o  o     o  o     o  o
 \       /      \       /      \       /      \  \   /  /       \  \   /  /
  \#####/        \#####/        \     /         \#####/           \#####/
   #####          #####          \   /           #####             #####
     |           /     \           *                            /  /   \  \
     o          o       o                                       o  o     o  o
"""
"""Sketches of the kinds: o is a winch, # the platform."""
_BUS_DRIVES = 4
"""Largest number of drives on a bus of 1 Mbit/s at 1 kHz."""
_APART_m = 0.15
"""Least distance of two proposed exit points: two winches side by side."""


@dataclass(frozen=True)
class RobotKind:
    """A kind of robot, with the shipped robot whose figures are its defaults."""

    name: str
    robot: Robot
    platform: Platform

    @property
    def cables(self) -> int:
        """Number of cables."""
        return len(self.robot.axes)

    @property
    def size(self) -> int:
        """Number of coordinates of a point."""
        return len(self.platform.home_m)

    @property
    def buses(self) -> int:
        """Number of buses for its drives."""
        return -(-self.cables // _BUS_DRIVES)

    @property
    def is_point(self) -> bool:
        """Whether all its cables meet in one point."""
        return len(set(self.platform.anchor_points_m)) == 1

    @property
    def controls_angles(self) -> bool:
        """Whether its cables control angles."""
        return len(self.platform.controlled) > self.size

    @property
    def turns_freely(self) -> bool:
        """Whether its platform has an orientation that the cables do not control."""
        return not self.controls_angles and not self.is_point

    @property
    def sides(self) -> str:
        """Names of the numbers of a frame's size."""
        return "width, height" if self.size == 2 else "width, depth, height"

    @property
    def frame_m(self) -> tuple[float, ...]:
        """Size of its frame: the extent of the exit points; the height is from the floor."""
        exits = np.array(self.platform.exit_points_m)
        spans = exits.max(axis=0) - exits.min(axis=0)
        return (*(float(span) for span in spans[:-1]), float(exits[:, -1].max()))

    @property
    def side_m(self) -> float:
        """Greatest distance of two anchor points."""
        return max(math.dist(*pair) for pair in combinations(self.platform.anchor_points_m, 2))

    def exits_m(self, frame_m: tuple[float, ...]) -> list[tuple[float, ...]]:
        """Return the exit points with the frame scaled to another size, to the mm.

        Points that would be too close to each other are moved apart within the frame.
        """
        exits = np.array(self.platform.exit_points_m) * np.array(frame_m) / self.frame_m
        low, high = exits.min(axis=0), exits.max(axis=0)
        for i, j in combinations(range(self.cables), 2):
            way = exits[j] - exits[i]
            if (distance := float(np.linalg.norm(way))) < _APART_m:
                pair = 0.5 * (exits[i] + exits[j]) + np.outer([-0.5, 0.5], way) * (
                    _APART_m / distance
                )
                pair += np.maximum(low - pair.min(axis=0), 0.0)
                exits[[i, j]] = pair + np.minimum(high - pair.max(axis=0), 0.0)
        return [tuple(round(float(x), 3) + 0.0 for x in point) for point in exits]

    def scale(self, frame_m: tuple[float, ...]) -> float:
        """Return the least ratio of a frame side to that of the shipped robot."""
        return min(size_m / usual_m for size_m, usual_m in zip(frame_m, self.frame_m, strict=True))


def kind_of(name: str) -> RobotKind:
    """Return the kind of this name, which must be in KINDS."""
    robot = load_robot(name)
    assert robot.platform is not None
    return RobotKind(name, robot, robot.platform)


Answers = dict[str, Any]
"""The answers by key, in SI units, with the type that `Question.read` returns."""
_COUNTS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight")
_POINTS = {2: "-2, 3", 3: "-2, 1.5, 3"}
_TORQUE_RESERVE = 0.85
"""Share of the torque available for tensions; the rest is for friction and control."""


class AnswerError(ValueError):
    """An invalid answer; the text says what is allowed."""


@dataclass(frozen=True)
class Question:
    """One question: its key, its text, how its answer is read, and its default.

    `read` converts a text into the value, given the answers so far, or raises AnswerError;
    `default` returns a text that `read` accepts.
    """

    key: str
    text: str
    read: Callable[[str, Answers], Any]
    default: Callable[[Answers], str]


def kind_question() -> Question:
    """Return the first question, on which all others depend."""

    def read(text: str, _: Answers) -> RobotKind:
        if text not in KINDS:
            raise AnswerError(f"allowed: {', '.join(KINDS)}")
        return kind_of(text)

    return Question("kind", "Kind of robot", read, lambda _: next(iter(KINDS)))


def questions(folder: Path, name: str, kind: RobotKind) -> list[Question]:
    """Return the questions about a kind in order; `folder` is the first to search for files."""
    drives = _drives(folder, name, kind)
    return [
        *drives,
        *_geometry(kind),
        *_limits(kind),
        *(_turning(kind) if kind.controls_angles else []),
    ]


def _drives(folder: Path, name: str, kind: RobotKind) -> list[Question]:
    """Return the questions on winches, buses and drives."""
    usual = kind.robot.axes[0].winch.profile
    buses = [
        Question("bus", "URL of the CAN bus", _name, lambda _: "socketcan:can0"),
        Question("bus_2", "URL of the second CAN bus", _name, lambda _: "socketcan:can1"),
    ]
    return [
        Question("name", "Name of the robot", _name, lambda _: name),
        Question(
            "winch", "Winches: name (`cdpr profiles list`) or path of a profile",
            lambda text, _: _winch(text, folder), lambda _: usual,
        ),
        *buses[: kind.buses],
        Question(
            "nodes", f"Node ids of the {_COUNTS[kind.cables]} drives", _nodes(kind.cables),
            lambda _: ", ".join(str(i + 1) for i in range(kind.cables)),
        ),
    ]  # fmt: skip


def _geometry(kind: RobotKind) -> list[Question]:
    """Return the questions on the frame, the exit points and the anchor points."""
    return [
        Question("frame_m", f"Frame: {kind.sides} (m)", _size(kind), lambda _: _text(kind.frame_m)),
        *(_exit(i, kind) for i in range(kind.cables)),
        *([] if kind.is_point else [_side(kind)]),
        *(_anchor(i, kind) for i in range(kind.cables)),
    ]


def _limits(kind: RobotKind) -> list[Question]:
    """Return the questions on torques, tensions, mass and motion."""
    platform, limits = kind.platform, kind.robot.limits
    torque, highest, least = (
        values[0] if values else otherwise
        for values, otherwise in (
            (limits.torque_Nm, 0.0), (limits.tension_max_N, 0.0), (limits.tension_min_N, 1.0),
        )
    )  # fmt: skip

    def usual(value: float, otherwise: Callable[[Answers], str]) -> Callable[[Answers], str]:
        """Default to the shipped robot's value if it has the same winch and is not the first."""

        def default(answers: Answers) -> str:
            same = answers["winch"][0] == kind.robot.axes[0].winch.profile
            return f"{value:g}" if same and kind.name != next(iter(KINDS)) else otherwise(answers)

        return default

    return [
        Question(
            "torque_Nm", "Torque limit at the motors (Nm)", _torque,
            usual(torque, lambda answers: f"{answers['winch'][1].motor.rated_torque_Nm:g}"),
        ),
        Question(
            "tension_min_N", "Least tension (N)", _number(0.1, 1e5),
            usual(least, lambda answers: f"{answers['winch'][1].cable.min_tension_N:g}"),
        ),
        Question(
            "tension_max_N", "Greatest tension (N)", _tension_max, usual(highest, _bearable_tension)
        ),
        Question(
            "mass_kg", "Mass of the platform (kg)", _number(0.01, 1e4),
            lambda answers: _figure(platform.mass_kg * answers["tension_max_N"] / highest),
        ),
        Question(
            "speed_m_s", "Speed along each direction (m/s)", _number(1e-3, 20.0),
            lambda answers: _figure(_speed_share(answers) * platform.speed_m_s),
        ),
        Question(
            "acceleration_m_s2", "Acceleration along each direction (m/s2)", _number(1e-3, 100.0),
            lambda _: f"{platform.acceleration_m_s2:g}",
        ),
    ]  # fmt: skip


def _turning(kind: RobotKind) -> list[Question]:
    """Return the questions on turned targets; angles are asked in degrees."""
    platform = kind.platform

    def share(answers: Answers) -> float:
        """Return the share of the shipped robot's angular speed for a larger platform."""
        side_m: float = answers["side_m"]
        return _speed_share(answers) * min(kind.side_m / side_m, 1.0)

    speed_deg_s = math.degrees(platform.angular_speed_rad_s)
    acceleration_deg_s2 = math.degrees(platform.angular_acceleration_rad_s2)
    return [
        Question(
            "angle_deg", "Largest rotation of targets from home's orientation (deg; 0: none)",
            _degrees(0.0, 179.0), lambda _: _figure(math.degrees(platform.workspace_angle_rad)),
        ),
        Question(
            "angular_speed_deg_s", "Angular speed about each axis (deg/s)", _degrees(0.1, 5000.0),
            lambda answers: _figure(share(answers) * speed_deg_s),
        ),
        Question(
            "angular_acceleration_deg_s2", "Angular acceleration about each axis (deg/s2)",
            _degrees(0.1, 5e5), lambda answers: _figure(share(answers) * acceleration_deg_s2),
        ),
    ]  # fmt: skip


def _speed_share(answers: Answers) -> float:
    """Return the winches' speed over that of the shipped robot's winches, at most 1.0."""
    winches: tuple[Winch, Winch] = (answers["winch"][1], answers["kind"].robot.axes[0].winch)
    taken, usual = (
        abs(winch.cable_m_per_motor_rad) * winch.motor.rated_speed_rad_s for winch in winches
    )
    return min(taken / usual, 1.0)


def places(
    kind: RobotKind,
    low_m: tuple[float, ...],
    high_m: tuple[float, ...],
    stand: Callable[[Answers], tuple[float, ...]],
) -> list[Question]:
    """Return the questions on the box of targets and the place of rest.

    `low_m` and `high_m` are the proposed box; `stand` proposes a place of rest under the final box.
    """
    point = _point(kind.size)
    names = ", ".join("xyz"[: kind.size])
    return [
        Question("low_m", f"Box of targets, least {names} (m)", point, lambda _: _text(low_m)),
        Question(
            "high_m",
            f"Box of targets, greatest {names} (m)",
            _upper_corner(kind.size),
            lambda _: _text(high_m),
        ),
        Question(
            "home_m",
            f"Where the platform stands at rest: {names} (m)",
            _home(kind.size),
            lambda answers: _text(stand(answers), digits=2),
        ),
    ]


def _exit(i: int, kind: RobotKind) -> Question:
    def default(answers: Answers) -> str:
        """Return the shipped robot's exit point, with its frame scaled to the answered size."""
        return _text(kind.exits_m(answers["frame_m"])[i])

    names = ", ".join("xyz"[: kind.size])
    return Question(
        f"exit_{i + 1}_m", f"Cable {i + 1} leaves at: {names} (m)", _point(kind.size), default
    )


def _side(kind: RobotKind) -> Question:
    if kind.turns_freely:
        text = "Side of the triangle on which the cables end (m; 0 if all end in one point)"
    else:
        text = "Greatest distance of two anchor points on the platform (m)"
    least = 0.0 if kind.turns_freely else 0.01

    def default(answers: Answers) -> str:
        """Return the shipped robot's value, scaled with the frame."""
        return _figure(min(kind.scale(answers["frame_m"]) * kind.side_m, 10.0))

    return Question("side_m", text, _number(least, 10.0), default)


def _anchor(i: int, kind: RobotKind) -> Question:
    def facing(answers: Answers) -> str:
        """Return the corner that faces the exit point; the cables keep their order around."""
        n = kind.cables
        exits = np.array([answers[f"exit_{j + 1}_m"] for j in range(n)])
        away = exits - exits.mean(axis=0)
        order = np.argsort(np.arctan2(away[:, 1], away[:, 0]))
        # the exit point furthest up or down fixes the triangle's first corner: above or below
        lone = int(np.argmax(np.abs(away[:, 1])))
        first = math.copysign(math.pi / 2, away[lone, 1])
        turn = int(np.where(order == i)[0][0]) - int(np.where(order == lone)[0][0])
        angle = first + turn * math.tau / n
        radius = answers["side_m"] / math.sqrt(3.0)
        return _text((radius * math.cos(angle), radius * math.sin(angle)), digits=4)

    def scaled(answers: Answers) -> str:
        share = 0.0 if kind.is_point else answers["side_m"] / kind.side_m
        return _text(tuple(share * x for x in kind.platform.anchor_points_m[i]), digits=4)

    names = ", ".join("xyz"[: kind.size])
    return Question(
        f"anchor_{i + 1}_m",
        f"Cable {i + 1} ends on the platform at: {names} from its middle (m)",
        _point(kind.size),
        facing if kind.turns_freely else scaled,
    )


def axis_names(answers: Answers) -> list[str]:
    """Return names for the axes, after the positions of their exit points."""
    kind = answers["kind"]
    exits = [answers[f"exit_{i + 1}_m"] for i in range(kind.cables)]
    if kind.turns_freely:
        (x0, y0), (x1, y1), (_, y2) = exits
        if x0 < x1 and y2 < min(y0, y1):
            return [axis.name for axis in kind.robot.axes]
    elif exits == kind.exits_m(answers["frame_m"]):
        names = [axis.name for axis in kind.robot.axes]
        if not names[0].startswith("axis"):
            return names
    return [f"cable {i + 1}" for i in range(kind.cables)]


def _name(text: str, _: Answers) -> str:
    if not text.strip() or not text.isprintable():
        raise AnswerError("allowed: a text of one line")
    return text.strip()


def _winch(text: str, folder: Path) -> tuple[str, Winch]:
    try:
        return text, load_winch(text, folder)
    except ProfileError as error:
        raise AnswerError(str(error)) from None


def _nodes(n: int) -> Callable[[str, Answers], tuple[int, ...]]:
    def read(text: str, _: Answers) -> tuple[int, ...]:
        try:
            nodes = tuple(int(part) for part in text.replace(",", " ").split())
        except ValueError:
            nodes = ()
        if len(nodes) != n or len(set(nodes)) != n or not all(0 < node < 127 for node in nodes):
            raise AnswerError(f"allowed: {n} different numbers from 1 to 126")
        return nodes

    return read


def _number(low: float, high: float) -> Callable[[str, Answers], float]:
    def read(text: str, _: Answers) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not low <= value <= high:
            raise AnswerError(f"allowed: a number from {low:g} to {high:g}")
        return value

    return read


def _figure(value: float) -> str:
    return f"{value:.3g}"


def _degrees(low: float, high: float) -> Callable[[str, Answers], float]:
    read = _number(low, high)
    return lambda text, answers: math.radians(read(text, answers))


def _point(size: int, such_as: str = "") -> Callable[[str, Answers], tuple[float, ...]]:
    example = such_as or _POINTS[size]

    def read(text: str, _: Answers) -> tuple[float, ...]:
        try:
            point = tuple(float(part) for part in text.replace(",", " ").split())
        except ValueError:
            point = ()
        if len(point) != size:
            raise AnswerError(f"allowed: {_COUNTS[size]} numbers in m, such as `{example}`")
        if not all(abs(x) <= WIDEST_m for x in point):
            raise AnswerError(f"allowed: up to {WIDEST_m:g} m each (in metres, not millimetres)")
        return point

    return read


def _size(kind: RobotKind) -> Callable[[str, Answers], tuple[float, ...]]:
    def read(text: str, answers: Answers) -> tuple[float, ...]:
        size = _point(kind.size, _text(kind.frame_m))(text, answers)
        if not all(x > 0.0 for x in size):
            raise AnswerError(f"allowed: {_COUNTS[kind.size]} numbers in m above 0")
        return size

    return read


def _torque(text: str, answers: Answers) -> float:
    return _number(0.001, answers["winch"][1].motor.peak_torque_Nm)(text, answers)


def _tension_max(text: str, answers: Answers) -> float:
    low_N = answers["tension_min_N"]
    high_N = answers["winch"][1].cable.breaking_force_N
    value = _number(low_N, high_N)(text, answers)
    if value == low_N:
        raise AnswerError(f"allowed: more than {low_N:g}, the least tension")
    return value


def _bearable_tension(answers: Answers) -> str:
    arm_m = abs(answers["winch"][1].cable_m_per_motor_rad)
    bears_N = min(
        _TORQUE_RESERVE * answers["torque_Nm"] / arm_m, answers["winch"][1].cable.breaking_force_N
    )
    return f"{max(math.floor(bears_N), 1.1 * answers['tension_min_N']):g}"


def _upper_corner(size: int) -> Callable[[str, Answers], tuple[float, ...]]:
    def read(text: str, answers: Answers) -> tuple[float, ...]:
        point, low = _point(size)(text, answers), answers["low_m"]
        if not all(high > x for high, x in zip(point, low, strict=True)):
            raise AnswerError(f"allowed: above {_text(low)}, each of them")
        return point

    return read


def _home(size: int) -> Callable[[str, Answers], tuple[float, ...]]:
    def read(text: str, answers: Answers) -> tuple[float, ...]:
        point, low, high = _point(size)(text, answers), answers["low_m"], answers["high_m"]
        beside = any(not low[i] <= point[i] <= high[i] for i in range(size - 1))
        if beside or point[-1] > high[-1]:
            ways = [f"{'xyz'[i]} from {low[i]:g} to {high[i]:g}" for i in range(size - 1)]
            raise AnswerError(f"allowed: {', '.join(ways)}, {'xyz'[size - 1]} up to {high[-1]:g}")
        return point

    return read


def _text(point_m: tuple[float, ...], digits: int = 3) -> str:
    # adding 0.0 avoids -0
    return ", ".join(f"{round(value, digits) + 0.0:g}" for value in point_m)
