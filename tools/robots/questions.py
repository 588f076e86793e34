"""What must be known of a new planar robot: questions, defaults that follow from the answers."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from profiles import ProfileError, Winch, load_winch

Answers = dict[str, Any]
"""What was answered, by key, of the type that the key's question gives it; SI."""
CABLES = 3
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


def questions(folder: Path, name: str) -> list[Question]:
    """Return the questions in their order; files are looked for in `folder` first."""
    return [
        Question("name", "Name of the robot", _name, lambda _: name),
        Question(
            "winch",
            "Winches: name (`cdpr profiles list`) or path of a profile",
            lambda text, _: _winch(text, folder),
            lambda _: "winch-mpp0923d",
        ),
        Question("bus", "URL of the CAN bus", _name, lambda _: "socketcan:can0"),
        Question("nodes", "Node ids of the three drives", _nodes, lambda _: "1, 2, 3"),
        Question("frame_m", "Frame: width, height (m)", _size, lambda _: "4, 3"),
        *(_exit(i) for i in range(CABLES)),
        Question(
            "side_m",
            "Side of the triangle on which the cables end (m; 0 if all end in one point)",
            _number(0.0, 10.0),
            lambda _: "0.15",
        ),
        *(_anchor(i) for i in range(CABLES)),
        Question("mass_kg", "Mass of the platform (kg)", _number(0.01, 1e4), lambda _: "2"),
        Question("torque_Nm", "Torque limit at the motors (Nm)", _torque, _rated_torque),
        Question(
            "tension_min_N",
            "Least tension (N)",
            _number(0.1, 1e5),
            lambda told: f"{told['winch'][1].cable.min_tension_N:g}",
        ),
        Question("tension_max_N", "Greatest tension (N)", _tension_max, _bearable_tension),
        Question(
            "speed_m_s", "Speed along each direction (m/s)", _number(1e-3, 20.0), lambda _: "0.5"
        ),
        Question(
            "acceleration_m_s2",
            "Acceleration along each direction (m/s2)",
            _number(1e-3, 100.0),
            lambda _: "2",
        ),
    ]


def places(
    low_m: tuple[float, float],
    high_m: tuple[float, float],
    stand: Callable[[Answers], tuple[float, float]],
) -> list[Question]:
    """Return the questions on the box of targets and the place of rest.

    The box is a proposal, `stand` makes one for the place of rest under the box that was answered.
    """
    return [
        Question(
            "low_m",
            "Box of targets, lower left corner: x, y (m)",
            _point,
            lambda _: _text(low_m),
        ),
        Question(
            "high_m",
            "Box of targets, upper right corner: x, y (m)",
            _upper_corner,
            lambda _: _text(high_m),
        ),
        Question(
            "home_m",
            "Where the platform stands at rest: x, y (m)",
            _home,
            lambda told: _text(stand(told), digits=2),
        ),
    ]


def _exit(i: int) -> Question:
    def default(told: Answers) -> str:
        width, height = told["frame_m"]
        return _text(((-width / 2, height), (width / 2, height), (0.0, 0.0))[i])

    return Question(f"exit_{i + 1}_m", f"Cable {i + 1} leaves at: x, y (m)", _point, default)


def _anchor(i: int) -> Question:
    def default(told: Answers) -> str:
        """Return the corner that faces the exit point, the cables in their order around."""
        exits = np.array([told[f"exit_{j + 1}_m"] for j in range(CABLES)])
        away = exits - exits.mean(axis=0)
        order = np.argsort(np.arctan2(away[:, 1], away[:, 0]))
        # the triangle stands as its first corner has it: below the middle, or above it
        lone = int(np.argmax(np.abs(away[:, 1])))
        first = math.copysign(math.pi / 2, away[lone, 1])
        turn = int(np.where(order == i)[0][0]) - int(np.where(order == lone)[0][0])
        angle = first + turn * math.tau / CABLES
        radius = told["side_m"] / math.sqrt(3.0)
        return _text((radius * math.cos(angle), radius * math.sin(angle)), digits=4)

    text = f"Cable {i + 1} ends on the platform at: x, y from its middle (m)"
    return Question(f"anchor_{i + 1}_m", text, _point, default)


def axis_names(told: Answers) -> list[str]:
    """Return what to call the axes, after where their cables leave."""
    (x0, y0), (x1, y1), (_, y2) = (told[f"exit_{i + 1}_m"] for i in range(CABLES))
    if x0 < x1 and y2 < min(y0, y1):
        return ["upper left", "upper right", "lower"]
    return [f"cable {i + 1}" for i in range(CABLES)]


def _name(text: str, _: Answers) -> str:
    if not text.strip() or not text.isprintable():
        raise AnswerError("allowed: a text of one line")
    return text.strip()


def _winch(text: str, folder: Path) -> tuple[str, Winch]:
    try:
        return text, load_winch(text, folder)
    except ProfileError as error:
        raise AnswerError(str(error)) from None


def _nodes(text: str, _: Answers) -> tuple[int, ...]:
    try:
        nodes = tuple(int(part) for part in text.replace(",", " ").split())
    except ValueError:
        nodes = ()
    if len(nodes) != CABLES or len(set(nodes)) != CABLES or not all(0 < n < 127 for n in nodes):
        raise AnswerError(f"allowed: {CABLES} different numbers from 1 to 126")
    return nodes


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


def _point(text: str, _: Answers) -> tuple[float, float]:
    try:
        x, y = (float(part) for part in text.replace(",", " ").split())
    except ValueError:
        x = y = math.nan
    if not (abs(x) <= 1000.0 and abs(y) <= 1000.0):
        raise AnswerError("allowed: two numbers in m, such as `-2, 3`")
    return x, y


def _size(text: str, told: Answers) -> tuple[float, float]:
    width, height = _point(text, told)
    if not (width > 0.0 and height > 0.0):
        raise AnswerError("allowed: two numbers in m above 0, such as `4, 3`")
    return width, height


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


def _upper_corner(text: str, told: Answers) -> tuple[float, float]:
    (x, y), (left, bottom) = _point(text, told), told["low_m"]
    if not (x > left and y > bottom):
        raise AnswerError(f"allowed: right of {left:g} and above {bottom:g}")
    return x, y


def _home(text: str, told: Answers) -> tuple[float, float]:
    (x, y), (left, _), (right, top) = _point(text, told), told["low_m"], told["high_m"]
    if not (left <= x <= right and y <= top):
        raise AnswerError(f"allowed: x from {left:g} to {right:g}, y up to {top:g}")
    return x, y


def _text(point_m: tuple[float, float], digits: int = 3) -> str:
    # 0.0 is added so that nothing is told as -0
    return ", ".join(f"{round(value, digits) + 0.0:g}" for value in point_m)
