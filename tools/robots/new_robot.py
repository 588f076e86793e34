"""A new robot's file, made of answers."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from cdpr_rt.exchange import FloatArray
from profiles import ProfileError, Robot, load_robot
from profiles.platform import Platform
from tools.commissioned import folder_called
from tools.errors import BadInputError
from tools.robots.questions import (
    CABLES,
    AnswerError,
    Answers,
    Question,
    axis_names,
    places,
    questions,
)
from tools.robots.statics import Box, PlanarStatics

Ask = Callable[[Question, str, str], str]
"""Takes a question, its default and what was wrong with the last answer; returns the answer."""
_STAND_SHARE = 0.1
"""Of the height in which targets could be taken, what is left between the stand and the box."""


def answers_of(path: Path, given: Mapping[str, str], ask: Ask) -> Answers:
    """Return what is to be known of the robot that `path` will describe.

    What is in `given` is not asked; raises BadInputError for what is wrong there.
    """
    told: Answers = {}
    asked = questions(path.parent, path.stem)
    known = [q.key for q in (*asked, *places((0.0, 0.0), (1.0, 1.0), proposed_stand))]
    for key in given:
        if key not in known:
            raise BadInputError(f"--set {key}: no such question; allowed: {', '.join(known)}")
    for question in asked:
        told[question.key] = _answer(question, told, given, ask)
    for question in places(*proposed_box(told), proposed_stand):
        told[question.key] = _answer(question, told, given, ask)
    return told


def _answer(question: Question, told: Answers, given: Mapping[str, str], ask: Ask) -> object:
    default, problem = question.default(told), ""
    while True:
        text = given.get(question.key)
        if text is None:
            text = ask(question, default, problem)
        try:
            return question.read(text, told)
        except AnswerError as error:
            problem = f"value {text!r}; {error}"
            if question.key in given:
                raise BadInputError(f"--set {question.key}: {problem}") from None


def proposed_box(told: Answers) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the largest box of targets that the cables can hold, to the cm, or one to begin with.

    A tenth of it is left below for the stand.
    """
    exits = np.array([told[f"exit_{i + 1}_m"] for i in range(CABLES)])
    middle, size = 0.5 * (exits.min(axis=0) + exits.max(axis=0)), np.ptp(exits, axis=0)
    around = Box(_pair(middle - 0.5 * size), _pair(middle + 0.5 * size))
    found = _statics_of(told, around).largest_box(around)
    if found is not None:
        height = found.high_m[1] - found.low_m[1]
        low = (
            np.ceil(100.0 * (np.array(found.low_m) + _STAND_SHARE * np.array([0.0, height])))
            / 100.0
        )
        high = np.floor(100.0 * np.array(found.high_m)) / 100.0
        if (low < high).all():
            return _pair(low), _pair(high)
    aside = np.maximum(0.1 * size, 0.05)
    return _pair(middle - aside), _pair(middle + aside)


def proposed_stand(told: Answers) -> tuple[float, float]:
    """Return where under the box of targets the cables turn the platform least.

    Where they turn it they might tip it on its stand, and lengths learnt there are wrong by that.
    """
    (left, bottom), (right, top) = told["low_m"], told["high_m"]
    below = bottom - _STAND_SHARE / (1.0 - _STAND_SHARE) * (top - bottom)
    xs = np.linspace(left, right, 41)
    xs = xs[np.argsort(np.abs(xs - 0.5 * (left + right)), kind="stable")]
    places = np.stack([xs, np.full(xs.size, math.ceil(100.0 * below) / 100.0)], axis=-1)
    statics = _statics_of(told, Box(told["low_m"], told["high_m"]))
    turned = np.where(statics.is_target(places), np.abs(statics.angle_rad(places)), math.inf)
    turned = np.where(np.isnan(turned), math.inf, turned)
    # what differs by less than anybody sees is alike, and the first of them is in the middle
    return _pair(places[int(np.round(turned, 2).argmin())])


def _statics_of(told: Answers, box: Box) -> PlanarStatics:
    low_N, high_N = told["tension_min_N"], told["tension_max_N"]
    return PlanarStatics(_platform_of(told, box), np.full(3, low_N), np.full(3, high_N))


def _platform_of(told: Answers, box: Box) -> Platform:
    middle = 0.5 * (np.array(box.low_m) + box.high_m)
    return Platform(
        mass_kg=told["mass_kg"],
        home_m=_pair(middle),
        home_tolerance_m=0.05,
        workspace_min_m=box.low_m,
        workspace_max_m=box.high_m,
        speed_m_s=told["speed_m_s"],
        acceleration_m_s2=told["acceleration_m_s2"],
        exit_points_m=tuple(told[f"exit_{i + 1}_m"] for i in range(CABLES)),
        anchor_points_m=tuple(told[f"anchor_{i + 1}_m"] for i in range(CABLES)),
    )


def _pair(point_m: FloatArray) -> tuple[float, float]:
    return float(point_m[0]), float(point_m[1])


def write_robot(told: Answers, path: Path) -> Robot:
    """Write what was answered into a new file and return the robot that it describes.

    Raises BadInputError where there is such a file already or none can be written, ProfileError
    for what contradicts itself; there is no file then.
    """
    text = text_of(told)
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise BadInputError(f"{path}: exists already, and is not written over") from None
    except OSError as error:
        raise BadInputError(f"{path}: {error.strerror}") from None
    try:
        return load_robot(path)
    except ProfileError:
        path.unlink()
        raise


def text_of(told: Answers) -> str:
    """Return the answers as a robot's file, with comments."""
    winch, _ = told["winch"]
    names = axis_names(told)
    axes = [
        _AXIS.format(
            name=_quoted(names[i]),
            winch=_quoted(winch),
            node=told["nodes"][i],
            commissioned=_quoted(f"motors/{folder_called(names[i], told['nodes'][i])}"),
            exit=_array(told[f"exit_{i + 1}_m"]),
            anchor=_array(told[f"anchor_{i + 1}_m"]),
        )
        for i in range(CABLES)
    ]
    head = _HEAD.format(
        name=_quoted(told["name"]),
        bus=_quoted(told["bus"]),
        home=_array(told["home_m"]),
        low=_array(told["low_m"]),
        high=_array(told["high_m"]),
        **{
            key: f"{float(told[key])!r}"
            for key in (
                "mass_kg",
                "speed_m_s",
                "acceleration_m_s2",
                "torque_Nm",
                "tension_min_N",
                "tension_max_N",
            )
        },
    )
    return "\n".join(_aligned(line) for line in (head + "".join(axes)).splitlines()) + "\n"


def _aligned(line: str) -> str:
    """Return a line with what is said of its key where that of the others is."""
    key, mark, said = line.partition("  # ")
    return f"{key:36}  # {said}" if mark else line


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


def _array(point_m: tuple[float, float]) -> str:
    return f"[{float(point_m[0])!r}, {float(point_m[1])!r}]"


_HEAD = """\
# A planar robot on three cables; x to the right, y upward, in m.
# `cdpr robot show` draws and checks it, `cdpr run` runs it.
name = {name}
sync_period_s = 0.001  # the control cycle

[[buses]]
name = "can0"
url = {bus}

[platform]
mass_kg = {mass_kg}
home_m = {home}  # where its middle is while it stands, at start and end
# home_tolerance_m = 0.05  # how far from there it may really be
workspace_min_m = {low}  # the box in which targets may lie
workspace_max_m = {high}
speed_m_s = {speed_m_s}  # along each direction
acceleration_m_s2 = {acceleration_m_s2}

[limits]
torque_Nm = {torque_Nm}  # at the motor
tension_min_N = {tension_min_N}
tension_max_N = {tension_max_N}
# slack_N = 5.0  # a quarter of tension_min_N if left out
"""
_AXIS = """
[[axes]]
name = {name}
winch = {winch}
bus = "can0"
node_id = {node}
exit_point_m = {exit}  # where its cable leaves the frame
anchor_point_m = {anchor}  # where it ends, from the platform's middle
# cable_sign = 1  # 1: a positive motor angle pays out; -1: it winds in
# commissioned = {commissioned}  # what `cdpr commission` learnt of this motor
"""
