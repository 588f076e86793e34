"""Write a new robot's file from the user's answers."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path

import numpy as np

from cdpr_drivers.robot.commissioned import folder_called
from cdpr_profiles import ProfileError, Robot, Winch, load_robot
from cdpr_profiles.platform import Platform
from cdpr_profiles.reader import closest
from cdpr_rt.arrays import FloatArray
from cdpr_rt.diagnosis.checks import diagnose, standing_tensions_N
from cdpr_rt.diagnosis.subject import Finding
from cdpr_rt.diagnosis.turning_checks import lower_when_turned_m
from cdpr_rt.model.platform_model import platform_model
from cdpr_rt.model.robot_arrays import RATED_SPEED_SHARE
from cdpr_rt.model.statics import Box, PlatformStatics
from cdpr_tools.errors import BadInputError
from cdpr_tools.rendering import rendered
from cdpr_tools.robots.questions import (
    AnswerError,
    Answers,
    Default,
    Question,
    RobotKind,
    axis_names,
    cable_speed_m_s,
    kind_question,
    places,
    questions,
)

Ask = Callable[[Question, Default, str], str]
"""Takes a question, its default and the error in the last answer; returns the answer."""
Stage = Callable[[str], AbstractContextManager[None]]
"""Takes a text about work that may take seconds, and shows it while a block runs."""
_STAND_SHARE, _STAND_m = 0.1, 0.5
"""Gap between stand and box, as a share of the height in which targets are possible. The same share
of the frame's height, up to `_STAND_m`, is the height of a stand that could be on the floor."""
_OVERSPEED = 1.25
"""Ratio of the limit of the motors' speed to the speed that they need."""
_MIDDLE, _MIDDLE_HEIGHT, _LOW = (0.3, 0.7), (0.25, 0.75), (0.0, 0.4)
"""Part of the frame in which the box of targets is searched first in space: along width and depth,
along its height, and along its height if all cables come from above."""
_CENTRED_SHARE = 0.6
"""A box about the frame's middle is proposed if it has this share of the largest box's area."""
_HANGING_SHARE, _NEAR_m = 0.5, 0.01
"""Where masses are tried: share of the upper exit points' height; half the side of a box there."""
_MASSES = np.geomspace(0.02, 50.0, 80)
_SHRUNK = np.linspace(1.0, 0.5, 26)


def _silently(_: str) -> AbstractContextManager[None]:
    return nullcontext()


def answers_of(path: Path, given: Mapping[str, str], ask: Ask, stage: Stage = _silently) -> Answers:
    """Return all answers about the robot that `path` will describe.

    Answers in `given` are not asked for; raises BadInputError if one of them is invalid. The
    entry "origins" gives the source of each default that was used.
    """
    first = kind_question()
    answers: Answers = {"origins": {}}
    _answer(first, answers, given, ask)
    kind = answers["kind"]
    asked = questions(path.parent, path.stem, kind, held_masses)
    nowhere = (0.0,) * kind.size
    last = [q.key for q in places(kind, nowhere, nowhere, proposed_stand, 0.0)]
    known = [first.key, *(q.key for q in asked), *last]
    unknown = [key for key in given if key not in known]
    if unknown:
        near = closest(unknown[0], known) if len(unknown) == 1 else None
        hint = f"did you mean {near!r}? " if near else ""
        raise BadInputError(
            f"--set {', '.join(unknown)}: no such question; {hint}"
            f"allowed for {kind.name}: {', '.join(known)}"
        )
    for question in asked:
        _answer(question, answers, given, ask)
    with stage("computing where the cables hold the platform"):
        box = proposed_box(answers)
    angle_deg = math.degrees(answers.get("angle_deg", 0.0))
    for question in places(kind, *box, proposed_stand, angle_deg):
        _answer(question, answers, given, ask)
    return answers


def _answer(question: Question, answers: Answers, given: Mapping[str, str], ask: Ask) -> None:
    """Add the answer to a question, unless earlier answers make it meaningless."""
    if not question.is_asked(answers):
        return
    default, problem = question.default(answers), ""
    while True:
        text = given.get(question.key)
        if text is None:
            text = ask(question, default, problem)
        try:
            answers[question.key] = question.read(text, answers)
            if text == default.text and default.origin:
                answers["origins"][question.key] = default.origin
            return
        except AnswerError as error:
            problem = f"value {text!r}; {error}"
            if question.key in given:
                raise BadInputError(f"--set {question.key}: {problem}") from None


def proposed_box(answers: Answers) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return a large box of targets that the cables can hold, rounded to cm, or a first guess.

    In space, the middle of the frame is searched first; if all cables come from above, not its
    upper part. Below the box a gap remains for the stand: a tenth of the height, or the depth of a
    rotated platform. Cables from above can lower a platform to the floor, so its stand is higher,
    to leave room below. The box is smaller if the motors could not hold the platform continuously.
    """
    exits = np.array([answers[f"exit_{i + 1}_m"] for i in range(answers["kind"].cables)])
    least, most = exits.min(axis=0), exits.max(axis=0)
    stand_m = -math.inf
    if least[-1] > 0.5 * most[-1]:  # all cables come from above
        least[-1] = 0.0
        lowest_m = min(answers[f"anchor_{i + 1}_m"][-1] for i in range(answers["kind"].cables))
        stand_m = min(_STAND_SHARE * most[-1], _STAND_m) - min(lowest_m, 0.0)
    middle, size = 0.5 * (least + most), most - least
    for found in _held_boxes(answers, least, most):
        whole_m = found.high_m[-1] - found.low_m[-1]
        gap_m = max(_STAND_SHARE * whole_m, _lower_when_turned_m(answers, found))
        gap_m += max(stand_m - found.low_m[-1], 0.0)
        low = np.array(found.low_m) + gap_m * np.eye(len(size))[-1]
        low, high = np.ceil(100.0 * low) / 100.0, np.floor(100.0 * np.array(found.high_m)) / 100.0
        if (low < high).all():
            return _settled(answers, _centred(Box(*_bearable(answers, low, high)), middle))
    aside = np.maximum(0.1 * size, 0.05)
    return _point(middle - aside), _point(middle + aside)


def _held_boxes(answers: Answers, least: FloatArray, most: FloatArray) -> Iterator[Box]:
    """Yield the largest boxes in parts of the frame that are held, the best part first."""
    around = Box(_point(least), _point(most))
    inner = around
    if least.size == 3:
        ways = [_MIDDLE, _MIDDLE, _LOW if answers["kind"].hangs else _MIDDLE_HEIGHT]
        low, high = (least + np.array(ends) * (most - least) for ends in zip(*ways, strict=True))
        inner = Box(_point(low), _point(high))
    for part in dict.fromkeys((inner, around)):
        if (box := _statics_of(answers, part).largest_box(part)) is not None:
            yield box
    # if no box keeps the reserve at all orientations, take one that is at least held
    if (box := _statics_of(answers, around).largest_held(around)) is not None:
        yield box


def held_masses(answers: Answers, usual_kg: float) -> tuple[float, float] | None:
    """Return the least and greatest mass that can be accelerated in the middle of the frame.

    The masses tried are up to `_MASSES` times as large or small as `usual_kg`. Returns None if all
    fail.
    """
    exits = np.array([answers[f"exit_{i + 1}_m"] for i in range(answers["kind"].cables)])
    place = 0.5 * (exits.min(axis=0) + exits.max(axis=0))
    if answers["kind"].hangs:
        place[-1] *= _HANGING_SHARE
    around = Box(_point(place - _NEAR_m), _point(place + _NEAR_m))
    held = [
        kg
        for kg in usual_kg * _MASSES
        if _statics_of(answers | {"mass_kg": float(kg)}, around).is_target(place)
    ]
    return (held[0], held[-1]) if held else None


def _centred(box: Box, middle_m: FloatArray) -> Box:
    """Return the largest box about `middle_m` in `box` if it is almost as large, else `box`."""
    low, high = np.array(box.low_m), np.array(box.high_m)
    half = np.minimum(high - middle_m, middle_m - low)[:-1]
    if half.min() <= 0.0 or np.prod(2.0 * half / (high - low)[:-1]) < _CENTRED_SHARE:
        return box
    low[:-1], high[:-1] = middle_m[:-1] - half, middle_m[:-1] + half
    return Box(_point(np.round(low, 2)), _point(np.round(high, 2)))


def _settled(answers: Answers, box: Box) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the largest box of targets in `box`, searched about its new middle, to the cm."""
    found = _statics_of(answers, box).largest_box(box) or box
    low, high = np.ceil(100.0 * np.array(found.low_m)), np.floor(100.0 * np.array(found.high_m))
    return (
        (_point(low / 100.0), _point(high / 100.0))
        if (low < high).all()
        else (box.low_m, box.high_m)
    )


def _lower_when_turned_m(answers: Answers, box: Box) -> float:
    """Return how much lower the platform reaches when turned, to the cm."""
    return math.ceil(100.0 * lower_when_turned_m(_statics_of(answers, box))) / 100.0


def _bearable(
    answers: Answers, low: FloatArray, high: FloatArray
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the box, shrunk until the motors can hold the platform continuously throughout."""
    winch: Winch = answers["winch"][1]
    rated_N = winch.motor.rated_torque_Nm / abs(winch.cable_m_per_motor_rad)
    for share in _SHRUNK:
        aside = 0.5 * (1.0 - share) * (high - low)
        aside[-1] *= 2.0
        least = low + aside * (np.arange(low.size) < low.size - 1)
        box = Box(_point(np.round(least, 2)), _point(np.round(high - aside, 2)))
        if standing_tensions_N(_statics_of(answers, box)).max() <= rated_N:
            return box.low_m, box.high_m
    return _point(low), _point(high)


def proposed_stand(answers: Answers) -> tuple[float, ...]:
    """Return a place under the middle of the box of targets.

    For a platform that turns freely, it is where the cables turn the platform least. Otherwise they
    might tilt it on its stand, and the lengths measured there would be wrong.
    """
    low, high = np.array(answers["low_m"]), np.array(answers["high_m"])
    below_m = _STAND_SHARE / (1.0 - _STAND_SHARE) * (high[-1] - low[-1])
    box = Box(answers["low_m"], answers["high_m"])
    statics = _statics_of(answers, box)
    below = low[-1] - max(math.floor(100.0 * below_m) / 100.0, _lower_when_turned_m(answers, box))
    # round to the cm towards the room's origin: 0 if the box is centred to within half a cm
    aside = np.trunc(np.round(50.0 * (low + high)[:-1], 6)) / 100.0
    middle = np.array([*aside, below])
    if not statics.turns_freely:
        return _point(middle)
    xs = np.linspace(low[0], high[0], 41)
    xs = xs[np.argsort(np.abs(xs - middle[0]), kind="stable")]
    places = np.stack([xs, np.full(xs.size, middle[1])], axis=-1)
    turned = np.where(statics.is_target(places), np.abs(statics.angle_rad(places)), math.inf)
    turned = np.where(np.isnan(turned), math.inf, turned)
    # round away differences that nobody sees, so that the place nearest to the middle is chosen
    return _point(places[int(np.round(turned, 2).argmin())])


def _statics_of(answers: Answers, box: Box) -> PlatformStatics:
    low_N, high_N = (
        np.full(answers["kind"].cables, answers[f"tension_{end}_N"]) for end in ("min", "max")
    )
    return PlatformStatics(platform_model(_platform_of(answers, box), low_N, high_N))


def _platform_of(answers: Answers, box: Box) -> Platform:
    kind: RobotKind = answers["kind"]
    cables = range(kind.cables)
    return Platform(
        mass_kg=answers["mass_kg"],
        home_m=_point(0.5 * (np.array(box.low_m) + box.high_m)),
        home_tolerance_m=0.05,
        workspace_min_m=box.low_m,
        workspace_max_m=box.high_m,
        speed_m_s=kind.platform.speed_m_s,  # nothing here depends on speeds
        acceleration_m_s2=answers["acceleration_m_s2"],
        exit_points_m=tuple(answers[f"exit_{i + 1}_m"] for i in cables),
        anchor_points_m=tuple(answers[f"anchor_{i + 1}_m"] for i in cables),
        workspace_angle_rad=answers.get("angle_deg", 0.0),
        angular_speed_rad_s=kind.platform.angular_speed_rad_s,
        angular_acceleration_rad_s2=answers.get("angular_acceleration_deg_s2", 0.0),
    )


def _point(point_m: FloatArray) -> tuple[float, ...]:
    return tuple(float(x) for x in point_m)


def write_robot(
    answers: Answers, path: Path, *, over: bool = False
) -> tuple[Robot | None, list[Finding]]:
    """Write the answers into a file; return the robot that it describes, and what is wrong with it.

    The robot is None if its file cannot be read again. An existing file is replaced only if this
    command has written it, as `over` says. Otherwise, or if writing fails, raises BadInputError.
    """
    try:
        with path.open("w" if over else "x", encoding="utf-8") as file:
            file.write(text_of(answers))
    except FileExistsError:
        raise BadInputError(f"{path}: already exists, and is not overwritten") from None
    except OSError as error:
        raise BadInputError(f"{path}: {error.strerror}") from None
    try:
        robot = load_robot(path)
    except ProfileError as error:
        return None, [Finding(error.key, error.problem, impossible=True)]
    return robot, diagnose(robot)


_ANSWERED_BY = {
    "node_id": "nodes",
    "workspace_min_m": "low_m",
    "workspace_max_m": "high_m",
    "workspace_angle_rad": "angle_deg",
    "angular_speed_rad_s": "angular_speed_deg_s",
    "angular_acceleration_rad_s2": "angular_acceleration_deg_s2",
}
"""Maps keys without a number in a robot's file to their questions, if the names differ."""


def questioned(found: Sequence[Finding], answers: Answers, typed: Container[str]) -> set[str]:
    """Return the keys of the questions to ask again: other answers may remove the findings.

    A finding names such a key as a remedy; by default its own key counts. If a point is a default,
    it follows from the size of the frame or platform, so that size is asked for instead.
    """
    keys = set()
    for finding in found:
        where, _, key = (finding.helps or finding.key).partition(".")
        key = key.partition("[")[0]
        key = _ANSWERED_BY.get(key, key)
        if point := re.fullmatch(r"(exit|anchor)_point_m", key):
            number = 1 + int(where.partition("[")[2].rstrip("]"))
            key = f"{point[1]}_{number}_m"
            size = {"exit": "frame_m", "anchor": "side_m"}[point[1]]
            key = size if key not in typed and size in answers else key
        keys.add(key)
    return keys & answers.keys()


def text_of(answers: Answers) -> str:
    """Return the answers as a robot's file, with comments."""
    kind, names = answers["kind"], axis_names(answers)
    on_each = -(-kind.cables // kind.buses)
    axes = [
        {
            "name": name,
            "bus": i // on_each,
            "node": answers["nodes"][i],
            "folder": f"motors/{folder_called(name, answers['nodes'][i])}",
            "exit_m": answers[f"exit_{i + 1}_m"],
            "anchor_m": answers[f"anchor_{i + 1}_m"],
        }
        for i, name in enumerate(names)
    ]
    text = rendered(
        "robot.toml.j2",
        answers=answers,
        kind=kind,
        what=kind.text,
        buses=[answers["bus"], answers.get("bus_2")][: kind.buses],
        axes=axes,
        angle_deg=math.degrees(answers.get("angle_deg", 0.0)),
        speed_rad_s=_speed_limit(answers),
    )
    return "\n".join(map(_aligned, text.splitlines())) + "\n"


def _speed_limit(answers: Answers) -> float | None:
    """Return the limit of the motors' speed, rad/s; None if its default is enough."""
    winch: Winch = answers["winch"][1]
    speeds = answers["speed_m_s"], answers.get("angular_speed_deg_s", 0.0)
    needed = cable_speed_m_s(answers, *speeds) / abs(winch.cable_m_per_motor_rad)
    limit = math.ceil(_OVERSPEED * needed)
    return limit if limit > RATED_SPEED_SHARE * winch.motor.rated_speed_rad_s else None


def _aligned(line: str) -> str:
    """Return a line with its comment aligned with those of the other lines."""
    key, mark, said = line.partition("  # ")
    return f"{key:36}  # {said}" if mark else line
