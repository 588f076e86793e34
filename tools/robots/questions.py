"""The questions about a new cable robot, with defaults that follow from earlier answers."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from cdpr_profiles import ProfileError, Robot, Winch, load_robot, load_winch
from cdpr_profiles.platform import Platform, WIDEST_m
from cdpr_rt.arrays import FloatArray
from cdpr_rt.diagnosis.checks import rounded_down
from cdpr_rt.model.robot_arrays import CABLE_SAFETY
from cdpr_rt.platform.motor_learning import FRICTION_SHARE

# Kinds of cable robots that `cdpr robot new` describes; each is modelled on a shipped robot.

KINDS = {
    "planar-3": "in a plane, x and y: 3 cables, and the platform turns freely",
    "planar-4": "in a plane, x, y and angle: 4 cables, one more than the directions",
    "point-4": "a point in space, x, y, z: 4 cables from above",
    "suspended-6": "a platform in space on 6 cables from above, the fewest possible",
    "suspended-8": "a platform in space on 8 cables from above: more room to turn",
    "spatial-8": "a platform in space, 8 cables from above and below: stiffest",
}
"""Description, and reason for the number of cables, by the kind's name."""
SEVEN_CABLES = {"suspended-7": "suspended-8", "spatial-7": "spatial-8"}
"""Kinds of imported models, and the kinds whose last cable they lack."""
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
"""Smallest distance of two proposed exit points, for two winches side by side."""
_ROUND_m = 0.5
"""Proposed sizes of a frame are multiples of this."""


@dataclass(frozen=True)
class RobotKind:
    """A kind of robot, with the shipped robot whose figures are its defaults."""

    name: str
    robot: Robot
    platform: Platform

    @property
    def text(self) -> str:
        """Its description."""
        return KINDS.get(self.name) or f"{KINDS[SEVEN_CABLES[self.name]]}; without one of them"

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
    def hangs(self) -> bool:
        """Whether all its cables come from above: only its weight tightens them."""
        heights = [point[-1] for point in self.platform.exit_points_m]
        return min(heights) > 0.5 * max(heights)

    @property
    def frame_m(self) -> tuple[float, ...]:
        """Size of its frame: the extent of the exit points, rounded; the height is from floor."""
        exits = np.array(self.platform.exit_points_m)
        size = [*np.ptp(exits, axis=0)[:-1], exits[:, -1].max()]
        return tuple(max(round(float(x) / _ROUND_m), 1) * _ROUND_m for x in size)

    @property
    def side_m(self) -> float:
        """Greatest distance between two anchor points."""
        return max(math.dist(*pair) for pair in combinations(self.platform.anchor_points_m, 2))

    def exits_m(self, frame_m: tuple[float, ...]) -> list[tuple[float, ...]]:
        """Return exit points in the corners of a frame, to the mm.

        The room's zero is the middle of the floor. Each exit point of the shipped robot moves to
        the nearest corner or middle of a side. Two cables in one place leave side by side.
        """
        exits = np.array(self.platform.exit_points_m)
        low, high = exits.min(axis=0), exits.max(axis=0)
        beside = (2.0 * exits - low - high)[:, :-1] / (high - low)[:-1]
        corners = np.column_stack([np.round(beside), np.round(exits[:, -1] / high[-1])])
        places = corners * np.array([*(0.5 * x for x in frame_m[:-1]), frame_m[-1]])
        for i, j in combinations(range(self.cables), 2):
            if (corners[i] == corners[j]).all():
                aside = _side_by_side(corners[i, :-1], beside[[i, j]])
                apart_m = max(_APART_m, self.scale(frame_m) * math.dist(exits[i], exits[j]))
                places[[i, j], :-1] += aside * (apart_m / np.linalg.norm(aside[1] - aside[0]))
        return [tuple(round(float(x), 3) + 0.0 for x in point) for point in places]

    def scale(self, frame_m: tuple[float, ...]) -> float:
        """Return the least ratio of a frame side to that of the shipped robot."""
        return min(size_m / usual_m for size_m, usual_m in zip(frame_m, self.frame_m, strict=True))


def _side_by_side(corner: FloatArray, beside: FloatArray) -> FloatArray:
    """Return directions (2, k) in which two cables leave a place that they share.

    `beside` (2, k) are their usual places, from -1 to 1. In a corner, each cable moves inward along
    the direction in which it is usually the inner one. On a side, the cables move away from each
    other.
    """
    inner = np.abs(beside) < np.abs(beside[::-1])
    apart = 0.5 * np.sign(beside - beside[::-1])
    return np.where(corner == 0.0, apart, -corner * inner)


def kind_of(name: str) -> RobotKind:
    """Return the kind of this name, which must be in KINDS or SEVEN_CABLES."""
    robot = load_robot(SEVEN_CABLES.get(name, name))
    platform = robot.platform
    assert platform is not None
    if name in SEVEN_CABLES:
        robot = replace(robot, axes=robot.axes[:-1])
        platform = replace(
            platform,
            exit_points_m=platform.exit_points_m[:-1],
            anchor_points_m=platform.anchor_points_m[:-1],
        )
    return RobotKind(name, robot, platform)


Answers = dict[str, Any]
"""The answers by key, in SI units, with the type that `Question.read` returns."""
_COUNTS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight")
Masses = Callable[[Answers, float], tuple[float, float] | None]
"""Returns the least and greatest mass that the cables hold in the middle of the frame. It takes the
answers so far and a mass with which the search starts. It returns None if no mass is found.
"""
_POINTS = {2: "-2, 3", 3: "-2, 1.5, 3"}
_PEAK_SHARE, _RATED_TIMES = 0.5, 2.0
"""Proposed torque, if rated torque is too little for cables that pull against each other: the
smaller of these multiples of peak and rated torque."""
_RANGE = 10.0
"""Smallest ratio of greatest to least tension for which such cables need only the rated torque."""
_TORQUE_RESERVE = 0.85
"""Share of the torque available for tensions; the rest is for friction and control."""
_LEAST, _LEAST_HANGING = 0.25, 0.1
"""Largest proposed ratio of least to greatest tension; the second if all cables come from above."""
_LEAST_MASS, _MOST_MASS = 1.25, 0.5
"""Limits of the proposed mass: multiples of the least and greatest mass that the cables hold."""
_HANGING_MASS = 0.75
"""Proposed mass as a share of the greatest, if only the weight tightens the cables. A lighter
platform has a smaller box of targets."""
_DEFAULT_SPEED_SHARE, _SPEED_SHARE = 0.5, 0.8
"""Shares of the winches' rated speed: for the proposed speeds in all directions together, and for
the highest speed along all directions that an answer may give."""


class AnswerError(ValueError):
    """An invalid answer; the text says what is allowed."""


class Default(NamedTuple):
    """The default of a question, and where it comes from as text, "" if that is obvious."""

    text: str
    origin: str = ""


@dataclass(frozen=True)
class Question:
    """One question: its key, its text, how its answer is read, and its default.

    `read` converts a text into the value, given the answers so far, or raises AnswerError;
    `default` returns a text that `read` accepts.
    """

    key: str
    text: str
    read: Callable[[str, Answers], Any]
    default: Callable[[Answers], Default]
    is_asked: Callable[[Answers], bool] = lambda _: True


def kind_question() -> Question:
    """Return the first question, on which all others depend."""

    def read(text: str, _: Answers) -> RobotKind:
        if text not in KINDS | SEVEN_CABLES:
            raise AnswerError(f"allowed: {', '.join(KINDS)}")
        return kind_of(text)

    return Question("kind", "Kind of robot", read, lambda _: Default(next(iter(KINDS))))


def questions(folder: Path, name: str, kind: RobotKind, masses: Masses) -> list[Question]:
    """Return the questions about a kind up to the box of targets, in order.

    `folder` is the first to search for files.
    """
    return [
        *_drives(folder, name, kind),
        *_geometry(kind),
        *_limits(kind, masses),
        *(_turning(kind) if kind.controls_angles else []),
    ]


def _drives(folder: Path, name: str, kind: RobotKind) -> list[Question]:
    """Return the questions on winches, buses and drives."""
    usual = kind.robot.axes[0].winch.profile
    buses = [
        Question("bus", "URL of the CAN bus", _name, lambda _: Default("socketcan:can0")),
        Question("bus_2", "URL of the second CAN bus", _name, lambda _: Default("socketcan:can1")),
    ]
    return [
        Question("name", "Name of the robot", _name, lambda _: Default(name)),
        Question(
            "winch", "Winches: name (`cdpr profiles list`) or path of a profile",
            lambda text, _: _winch(text, folder),
            lambda _: Default(usual, f"those of {kind.name}"),
        ),
        *buses[: kind.buses],
        Question(
            "nodes", f"Node ids of the {_COUNTS[kind.cables]} drives", _nodes(kind.cables),
            lambda _: Default(", ".join(str(i + 1) for i in range(kind.cables))),
        ),
    ]  # fmt: skip


def _geometry(kind: RobotKind) -> list[Question]:
    """Return the questions on the frame, the exit points and the anchor points."""
    frame = Default(_text(kind.frame_m), f"about that of {kind.name}")
    zero = ", ".join("0" * kind.size)
    return [
        Question(
            "frame_m", f"Frame: {kind.sides} (m), with {zero} in the middle of its floor",
            _size(kind), lambda _: frame,
        ),
        *(_exit(i, kind) for i in range(kind.cables)),
        *([] if kind.is_point else [_side(kind)]),
        *(_anchor(i, kind) for i in range(kind.cables)),
    ]  # fmt: skip


def _limits(kind: RobotKind, masses: Masses) -> list[Question]:
    """Return the questions on torques, tensions, acceleration and mass."""
    platform = kind.platform
    assert kind.robot.limits.tension_max_N is not None
    usual_N = kind.robot.limits.tension_max_N[0]

    def mass(answers: Answers) -> Default:
        """Return the shipped robot's mass, scaled if its weight tightens the cables, or less."""
        share = answers["tension_max_N"] / usual_N if kind.hangs else 1.0
        kg, origin = share * platform.mass_kg, f"that of {kind.name}"
        if kind.hangs:
            origin = f"that of {kind.name}, scaled with the greatest tension"
        if (held := masses(answers, kg)) is None:
            return Default(f"{kg:.2g}", origin)
        least, most = held
        share = _HANGING_MASS if kind.hangs else _MOST_MASS
        if share * most < kg:
            kg, origin = share * most, f"{100.0 * share:.0f} % of the greatest"
        origin += f"; the cables hold {least:.2g} to {most:.2g} kg"
        return Default(f"{max(kg, _LEAST_MASS * least):.2g}", origin)

    return [
        Question(
            "torque_Nm", "Torque limit at the motors (Nm)", _torque, _usual_torque,
        ),
        Question("tension_max_N", "Greatest tension (N)", _tension_max, _bearable),
        Question("tension_min_N", "Least tension (N)", _tension_min, _taut),
        Question(
            "acceleration_m_s2", "Acceleration along each direction (m/s2)", _number(1e-3, 100.0),
            lambda _: Default(f"{platform.acceleration_m_s2:g}", f"that of {kind.name}"),
        ),
        Question("mass_kg", "Mass of the platform (kg)", _number(0.01, 1e5), mass),
    ]  # fmt: skip


def _turning(kind: RobotKind) -> list[Question]:
    """Return the questions on turned targets; angles are asked in degrees."""
    platform = kind.platform
    angle = _figure(math.degrees(platform.workspace_angle_rad))

    def acceleration(answers: Answers) -> Default:
        """Return the shipped robot's acceleration, less for a larger platform."""
        share = min(kind.side_m / answers["side_m"], 1.0)
        value = _figure(share * math.degrees(platform.angular_acceleration_rad_s2))
        return Default(value, f"that of {kind.name}, scaled with the platform")

    return [
        Question(
            "angle_deg", "Largest rotation of targets from home's orientation (deg; 0: none)",
            _degrees(0.0, 179.0), lambda _: Default(angle, f"that of {kind.name}"),
        ),
        Question(
            "angular_acceleration_deg_s2", "Angular acceleration about each axis (deg/s2)",
            _degrees(0.1, 5e5), acceleration, lambda answers: answers["angle_deg"] > 0.0,
        ),
    ]  # fmt: skip


# Speeds: what the winches can do in all directions together, and what the box has room for.


def _speeds(kind: RobotKind) -> list[Question]:
    """Return the questions on speeds, once box and accelerations are known."""

    def speed(answers: Answers) -> Default:
        wanted, share = _reached(answers)[0], _winch_share(answers)
        return Default(f"{share * wanted:.2g}", _speed_origin(answers, share))

    def angular_speed(answers: Answers) -> Default:
        wanted, share = _reached(answers)[1], _winch_share(answers)
        most = _spare_m_s(answers) / cable_speed_m_s(answers, 0.0, 1.0)
        value = math.degrees(min(share * wanted, _DEFAULT_SPEED_SHARE * most))
        return Default(f"{value:.2g}", _speed_origin(answers, share))

    def read_angular(text: str, answers: Answers) -> float:
        most = math.degrees(_spare_m_s(answers) / cable_speed_m_s(answers, 0.0, 1.0))
        return _degrees(0.01, _rounded_down(most))(text, answers)

    def read_speed(text: str, answers: Answers) -> float:
        most = _SPEED_SHARE * rated_speed_m_s(answers) / cable_speed_m_s(answers, 1.0, 0.0)
        return _number(1e-3, _rounded_down(most))(text, answers)

    turning = Question(
        "angular_speed_deg_s", "Angular speed about each axis (deg/s)", read_angular,
        angular_speed, lambda answers: answers["angle_deg"] > 0.0,
    )  # fmt: skip
    return [
        Question("speed_m_s", "Speed along each direction (m/s)", read_speed, speed),
        *([turning] if kind.controls_angles else []),
    ]


def rated_speed_m_s(answers: Answers) -> float:
    """Return the speed of a cable at the motor's rated speed."""
    winch: Winch = answers["winch"][1]
    return abs(winch.cable_m_per_motor_rad) * winch.motor.rated_speed_rad_s


def cable_speed_m_s(answers: Answers, speed_m_s: float, angular_speed_rad_s: float) -> float:
    """Return the highest speed of a cable with these speeds along and about all directions."""
    kind: RobotKind = answers["kind"]
    anchors_m = [answers[f"anchor_{i + 1}_m"] for i in range(kind.cables)]
    reach_m = max(math.hypot(*anchor_m) for anchor_m in anchors_m)
    angles = len(kind.platform.controlled) - kind.size
    turning_m_s = math.sqrt(angles) * angular_speed_rad_s * reach_m
    return math.sqrt(kind.size) * speed_m_s + turning_m_s


def _reached(answers: Answers) -> tuple[float, float]:
    """Return the speeds √(a L/2), reached within a quarter of the range L of positions, angles."""
    longest_m = max(np.subtract(answers["high_m"], answers["low_m"]))
    angle_rad = answers.get("angle_deg", 0.0)
    return (
        math.sqrt(0.5 * answers["acceleration_m_s2"] * longest_m),
        math.sqrt(answers.get("angular_acceleration_deg_s2", 0.0) * angle_rad),
    )


def _winch_share(answers: Answers) -> float:
    """Return the share, at most 1, of these speeds that needs half of the winches' rated speed."""
    needed_m_s = cable_speed_m_s(answers, *_reached(answers))
    return min(_DEFAULT_SPEED_SHARE * rated_speed_m_s(answers) / needed_m_s, 1.0)


def _spare_m_s(answers: Answers) -> float:
    """Return the part of the winches' rated speed that the answered speed leaves."""
    return rated_speed_m_s(answers) - cable_speed_m_s(answers, answers["speed_m_s"], 0.0)


def _speed_origin(answers: Answers, share: float) -> str:
    winches = f"rated speed of the winches, {rated_speed_m_s(answers):.2g} m/s"
    if share < 1.0:
        return f"all directions together take half of the {winches}"
    return f"reached within a quarter of the box; {winches}"


def places(
    kind: RobotKind,
    low_m: tuple[float, ...],
    high_m: tuple[float, ...],
    stand: Callable[[Answers], tuple[float, ...]],
    angle_deg: float,
) -> list[Question]:
    """Return the questions on the box of targets, the place of rest and the speeds.

    `low_m` and `high_m` are the proposed box; `stand` proposes a place of rest under the final box.
    """
    point = _point(kind.size)
    names = ", ".join("xyz"[: kind.size])
    origin = "a box in which the cables hold the platform" + (
        f", turned by up to {angle_deg:.3g} deg" if angle_deg > 0.0 else ""
    )
    return [
        Question(
            "low_m", f"Box of targets, least {names} (m)", point,
            lambda _: Default(_text(low_m), origin),
        ),
        Question(
            "high_m", f"Box of targets, greatest {names} (m)", _upper_corner(kind.size),
            lambda _: Default(_text(high_m), origin),
        ),
        Question(
            "home_m", f"Where the platform stands at rest: {names} (m)", _home(kind.size),
            lambda answers: Default(_text(stand(answers), digits=2), "below the box"),
        ),
        *_speeds(kind),
    ]  # fmt: skip


def _exit(i: int, kind: RobotKind) -> Question:
    def default(answers: Answers) -> Default:
        return Default(_text(kind.exits_m(answers["frame_m"])[i]), "on the edges of the frame")

    names = ", ".join("xyz"[: kind.size])
    return Question(
        f"exit_{i + 1}_m",
        f"Cable {i + 1} leaves the frame at: {names} (m)",
        _point(kind.size),
        default,
    )


def _side(kind: RobotKind) -> Question:
    if kind.turns_freely:
        text = "Side of the triangle on which the cables end (m; 0 if all end in one point)"
    else:
        text = "Greatest distance between two anchor points on the platform (m)"
    least = 0.0 if kind.turns_freely else 0.01

    def default(answers: Answers) -> Default:
        value = min(kind.scale(answers["frame_m"]) * kind.side_m, 10.0)
        return Default(_figure(value), f"that of {kind.name}, scaled with the frame")

    return Question("side_m", text, _number(least, 10.0), default)


def _anchor(i: int, kind: RobotKind) -> Question:
    def facing(answers: Answers) -> Default:
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
        place = radius * math.cos(angle), radius * math.sin(angle)
        return Default(_text(place, digits=4), "the corner that faces the exit point")

    def scaled(answers: Answers) -> Default:
        if kind.is_point:
            return Default(_text((0.0,) * kind.size), "all cables meet in one point")
        share = answers["side_m"] / kind.side_m
        place = tuple(share * x for x in kind.platform.anchor_points_m[i])
        return Default(_text(place, digits=4), f"that of {kind.name}, scaled with the platform")

    names = ", ".join("xyz"[: kind.size])
    return Question(
        f"anchor_{i + 1}_m",
        f"Cable {i + 1} ends on the platform at: {names} from its middle (m)",
        _point(kind.size),
        facing if kind.turns_freely else scaled,
    )


def axis_names(answers: Answers) -> list[str]:
    """Return names for the axes that tell where their exit points are."""
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
        raise AnswerError("allowed: one line of text")
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


def _rounded_down(value: float) -> float:
    return float(rounded_down(value))


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
    return _number(1.0, answers["winch"][1].cable.breaking_force_N)(text, answers)


def _tension_min(text: str, answers: Answers) -> float:
    value = _number(0.1, high_N := answers["tension_max_N"])(text, answers)
    if value == high_N:
        raise AnswerError(f"allowed: less than {high_N:g}, the greatest tension")
    return value


def _usual_torque(answers: Answers) -> Default:
    """Return the rated torque; more if cables that pull against each other briefly need it.

    Standing in the proposed box of targets never needs more than the rated torque.
    """
    winch: Winch = answers["winch"][1]
    motor = winch.motor
    rated_N = _TORQUE_RESERVE * motor.rated_torque_Nm / abs(winch.cable_m_per_motor_rad)
    if answers["kind"].hangs or rated_N > _RANGE * winch.cable.min_tension_N:
        return Default(f"{motor.rated_torque_Nm:g}", "their rated torque")
    torque_Nm = min(_PEAK_SHARE * motor.peak_torque_Nm, _RATED_TIMES * motor.rated_torque_Nm)
    origin = (
        f"for short times; {motor.rated_torque_Nm:g} Nm rated, {motor.peak_torque_Nm:g} Nm peak"
    )
    return Default(f"{torque_Nm:.2g}", origin)


def _bearable(answers: Answers) -> Default:
    winch: Winch = answers["winch"][1]
    bears_N = _TORQUE_RESERVE * answers["torque_Nm"] / abs(winch.cable_m_per_motor_rad)
    origin = f"{100.0 * _TORQUE_RESERVE:.0f} % of the torque limit"
    if (breaks_N := winch.cable.breaking_force_N / CABLE_SAFETY) < bears_N:
        bears_N, origin = breaks_N, f"the breaking force of the cable over {CABLE_SAFETY:g}"
    return Default(f"{max(math.floor(bears_N), 1.0):g}", origin)


def _taut(answers: Answers) -> Default:
    """Return the least tension: what the cable needs, but more than the winch's friction.

    Planned tensions lie between the least and the greatest one. If these two would be close
    together, the least tension is lowered.
    """
    winch: Winch = answers["winch"][1]
    rubs_N = FRICTION_SHARE * winch.motor.rated_torque_Nm / abs(winch.cable_m_per_motor_rad)
    value_N, origin = winch.cable.min_tension_N, "that of the cable's profile"
    if rubs_N > value_N:
        value_N, origin = rubs_N, "the usual friction of such winches"
    share = _LEAST_HANGING if answers["kind"].hangs else _LEAST
    if (most_N := share * answers["tension_max_N"]) < value_N:
        value_N, origin = most_N, f"{100.0 * share:.0f} % of the greatest tension"
    return Default(f"{value_N:.2g}", origin)


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
