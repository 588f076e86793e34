"""What must be known of a new cable robot: questions, defaults that follow from the answers."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_profiles import ProfileError, Winch, load_winch
from cdpr_tools.robots.kinds import KINDS, Kind, kind_of

Answers = dict[str, Any]
"""What was answered, by key, of the type that the key's question gives it; SI."""
_COUNTS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight")
_POINTS = {2: "-2, 3", 3: "-2, 1.5, 3"}
_TORQUE_RESERVE = 0.85
"""Share of the torque that tensions may take; the rest is for friction and for control."""


class AnswerError(ValueError):
    """An answer that cannot be; the text says what is allowed."""


@dataclass(frozen=True)
class Question:
    """One question: its key, its text, what it is taken for, and its usual answer.

    `read` turns a text into the value, given the answers so far, or raises AnswerError; `default`
    gives a text that `read` takes.
    """

    key: str
    text: str
    read: Callable[[str, Answers], Any]
    default: Callable[[Answers], str]


def kind_question() -> Question:
    """Return the first question, on which all others depend."""

    def read(text: str, _: Answers) -> Kind:
        if text not in KINDS:
            raise AnswerError(f"allowed: {', '.join(KINDS)}")
        return kind_of(text)

    return Question("kind", "Kind of robot", read, lambda _: next(iter(KINDS)))


def questions(folder: Path, name: str, kind: Kind) -> list[Question]:
    """Return the questions about a kind in their order; files are looked for in `folder` first."""
    n, platform, limits = kind.cables, kind.platform, kind.robot.limits
    usual = kind.robot.axes[0].winch.profile

    def template(told: Answers, value: str, otherwise: Callable[[Answers], str]) -> str:
        """Return the figure of the shipped robot, where its winch is taken and it is not first."""
        same = told["winch"][0] == usual and kind.name != next(iter(KINDS))
        return value if same else otherwise(told)

    torque, highest = (
        value[0] if value else 0.0 for value in (limits.torque_Nm, limits.tension_max_N)
    )
    least = limits.tension_min_N[0] if limits.tension_min_N else 1.0
    asked = [
        Question("name", "Name of the robot", _name, lambda _: name),
        Question(
            "winch",
            "Winches: name (`cdpr profiles list`) or path of a profile",
            lambda text, _: _winch(text, folder),
            lambda _: usual,
        ),
        Question("bus", "URL of the CAN bus", _name, lambda _: "socketcan:can0"),
    ]
    if kind.buses > 1:
        asked.append(
            Question("bus_2", "URL of the second CAN bus", _name, lambda _: "socketcan:can1")
        )
    asked += [
        Question(
            "nodes", f"Node ids of the {_COUNTS[n]} drives", _nodes(n),
            lambda _: ", ".join(str(i + 1) for i in range(n)),
        ),
        Question("frame_m", f"Frame: {kind.sides} (m)", _size(kind), lambda _: _text(kind.frame_m)),
        *(_exit(i, kind) for i in range(n)),
        *([] if kind.is_point else [_side(kind)]),
        *(_anchor(i, kind) for i in range(n)),
        Question(
            "mass_kg", "Mass of the platform (kg)", _number(0.01, 1e4),
            lambda _: f"{platform.mass_kg:g}",
        ),
        Question(
            "torque_Nm", "Torque limit at the motors (Nm)", _torque,
            lambda told: template(told, f"{torque:g}", _rated_torque),
        ),
        Question(
            "tension_min_N", "Least tension (N)", _number(0.1, 1e5),
            lambda told: template(
                told, f"{least:g}", lambda told: f"{told['winch'][1].cable.min_tension_N:g}"
            ),
        ),
        Question(
            "tension_max_N", "Greatest tension (N)", _tension_max,
            lambda told: template(told, f"{highest:g}", _bearable_tension),
        ),
        Question(
            "speed_m_s", "Speed along each direction (m/s)", _number(1e-3, 20.0),
            lambda _: f"{platform.speed_m_s:g}",
        ),
        Question(
            "acceleration_m_s2", "Acceleration along each direction (m/s2)", _number(1e-3, 100.0),
            lambda _: f"{platform.acceleration_m_s2:g}",
        ),
    ]  # fmt: skip
    return asked + (_turning(kind) if kind.turns else [])


def _turning(kind: Kind) -> list[Question]:
    """Return the questions on targets that are turned; angles are asked in degrees."""
    platform = kind.platform
    return [
        Question(key, text, _degrees(low, high), _told_in_degrees(usual))
        for key, text, low, high, usual in (
            ("angle_deg", "How far targets may be turned from home's orientation (deg; 0: not)",
             0.0, 179.0, platform.workspace_angle_rad),
            ("angular_speed_deg_s", "Angular speed about each axis (deg/s)",
             0.1, 5000.0, platform.angular_speed_rad_s),
            ("angular_acceleration_deg_s2", "Angular acceleration about each axis (deg/s2)",
             0.1, 5e5, platform.angular_acceleration_rad_s2),
        )
    ]  # fmt: skip


def places(
    kind: Kind,
    low_m: tuple[float, ...],
    high_m: tuple[float, ...],
    stand: Callable[[Answers], tuple[float, ...]],
) -> list[Question]:
    """Return the questions on the box of targets and the place of rest.

    The box is a proposal, `stand` makes one for the place of rest under the box that was answered.
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
            lambda told: _text(stand(told), digits=2),
        ),
    ]


def _exit(i: int, kind: Kind) -> Question:
    def default(told: Answers) -> str:
        """Return the shipped robot's exit point, its frame stretched to the size that is wanted."""
        return _text(kind.exit_m(i, told["frame_m"]))

    names = ", ".join("xyz"[: kind.size])
    return Question(
        f"exit_{i + 1}_m", f"Cable {i + 1} leaves at: {names} (m)", _point(kind.size), default
    )


def _side(kind: Kind) -> Question:
    if kind.name == "planar-3":
        text = "Side of the triangle on which the cables end (m; 0 if all end in one point)"
    else:
        text = "Greatest distance of two anchor points on the platform (m)"
    least = 0.0 if kind.name == "planar-3" else 0.01
    return Question("side_m", text, _number(least, 10.0), lambda _: f"{kind.side_m:.3g}")


def _anchor(i: int, kind: Kind) -> Question:
    def facing(told: Answers) -> str:
        """Return the corner that faces the exit point, the cables in their order around."""
        n = kind.cables
        exits = np.array([told[f"exit_{j + 1}_m"] for j in range(n)])
        away = exits - exits.mean(axis=0)
        order = np.argsort(np.arctan2(away[:, 1], away[:, 0]))
        # the triangle stands as its first corner has it: below the middle, or above it
        lone = int(np.argmax(np.abs(away[:, 1])))
        first = math.copysign(math.pi / 2, away[lone, 1])
        turn = int(np.where(order == i)[0][0]) - int(np.where(order == lone)[0][0])
        angle = first + turn * math.tau / n
        radius = told["side_m"] / math.sqrt(3.0)
        return _text((radius * math.cos(angle), radius * math.sin(angle)), digits=4)

    def scaled(told: Answers) -> str:
        share = 0.0 if kind.is_point else told["side_m"] / kind.side_m
        return _text(tuple(share * x for x in kind.platform.anchor_points_m[i]), digits=4)

    names = ", ".join("xyz"[: kind.size])
    return Question(
        f"anchor_{i + 1}_m",
        f"Cable {i + 1} ends on the platform at: {names} from its middle (m)",
        _point(kind.size),
        facing if kind.name == "planar-3" else scaled,
    )


def axis_names(told: Answers) -> list[str]:
    """Return what to call the axes, after where their cables leave."""
    kind = told["kind"]
    exits = [told[f"exit_{i + 1}_m"] for i in range(kind.cables)]
    if kind.name == "planar-3":
        (x0, y0), (x1, y1), (_, y2) = exits
        if x0 < x1 and y2 < min(y0, y1):
            return [axis.name for axis in kind.robot.axes]
    elif exits == [kind.exit_m(i, told["frame_m"]) for i in range(kind.cables)]:
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


def _told_in_degrees(angle_rad: float) -> Callable[[Answers], str]:
    return lambda _: f"{math.degrees(angle_rad):.3g}"


def _degrees(low: float, high: float) -> Callable[[str, Answers], float]:
    read = _number(low, high)
    return lambda text, told: math.radians(read(text, told))


def _point(size: int) -> Callable[[str, Answers], tuple[float, ...]]:
    def read(text: str, _: Answers) -> tuple[float, ...]:
        try:
            point = tuple(float(part) for part in text.replace(",", " ").split())
        except ValueError:
            point = ()
        if len(point) != size or not all(abs(x) <= 1000.0 for x in point):
            raise AnswerError(f"allowed: {_COUNTS[size]} numbers in m, such as `{_POINTS[size]}`")
        return point

    return read


def _size(kind: Kind) -> Callable[[str, Answers], tuple[float, ...]]:
    def read(text: str, told: Answers) -> tuple[float, ...]:
        size = _point(kind.size)(text, told)
        if not all(x > 0.0 for x in size):
            raise AnswerError(f"allowed: {_COUNTS[kind.size]} numbers in m above 0")
        return size

    return read


def _torque(text: str, told: Answers) -> float:
    return _number(0.001, told["winch"][1].motor.peak_torque_Nm)(text, told)


def _rated_torque(told: Answers) -> str:
    return f"{told['winch'][1].motor.rated_torque_Nm:g}"


def _tension_max(text: str, told: Answers) -> float:
    low_N = told["tension_min_N"]
    high_N = told["winch"][1].cable.breaking_force_N
    value = _number(low_N, high_N)(text, told)
    if value == low_N:
        raise AnswerError(f"allowed: more than {low_N:g}, the least tension")
    return value


def _bearable_tension(told: Answers) -> str:
    arm_m = abs(told["winch"][1].cable_m_per_motor_rad)
    bears_N = min(
        _TORQUE_RESERVE * told["torque_Nm"] / arm_m, told["winch"][1].cable.breaking_force_N
    )
    return f"{max(math.floor(bears_N), 1.1 * told['tension_min_N']):g}"


def _upper_corner(size: int) -> Callable[[str, Answers], tuple[float, ...]]:
    def read(text: str, told: Answers) -> tuple[float, ...]:
        point, low = _point(size)(text, told), told["low_m"]
        if not all(high > x for high, x in zip(point, low, strict=True)):
            raise AnswerError(f"allowed: above {_text(low)}, each of them")
        return point

    return read


def _home(size: int) -> Callable[[str, Answers], tuple[float, ...]]:
    def read(text: str, told: Answers) -> tuple[float, ...]:
        point, low, high = _point(size)(text, told), told["low_m"], told["high_m"]
        beside = any(not low[i] <= point[i] <= high[i] for i in range(size - 1))
        if beside or point[-1] > high[-1]:
            ways = [f"{'xyz'[i]} from {low[i]:g} to {high[i]:g}" for i in range(size - 1)]
            raise AnswerError(f"allowed: {', '.join(ways)}, {'xyz'[size - 1]} up to {high[-1]:g}")
        return point

    return read


def _text(point_m: tuple[float, ...], digits: int = 3) -> str:
    # 0.0 is added so that nothing is told as -0
    return ", ".join(f"{round(value, digits) + 0.0:g}" for value in point_m)
