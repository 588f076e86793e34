"""Write a new robot's file from the user's answers."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from cdpr_drivers.robot.commissioned import folder_called
from cdpr_profiles import ProfileError, Robot, Winch, load_robot
from cdpr_profiles.platform import Platform
from cdpr_profiles.reader import closest
from cdpr_rt.arrays import FloatArray
from cdpr_rt.diagnosis.checks import (
    refuse_impossible,
    standing_tensions_N,
)
from cdpr_rt.diagnosis.turning_checks import lower_when_turned_m
from cdpr_rt.model.platform_model import platform_model
from cdpr_rt.model.statics import Box, PlatformStatics
from cdpr_tools.errors import BadInputError
from cdpr_tools.report.page import rendered
from cdpr_tools.robots.questions import (
    KINDS,
    AnswerError,
    Answers,
    Question,
    axis_names,
    kind_question,
    places,
    questions,
)

Ask = Callable[[Question, str, str], str]
"""Takes a question, its default and the error in the last answer; returns the answer."""
_STAND_SHARE, _STAND_m = 0.1, 0.5
"""Gap between stand and box, as a share of the height in which targets are possible. Also the
height of a stand that could be on the floor, as a share of the frame's, up to `_STAND_m`."""
_SHRUNK = np.linspace(1.0, 0.5, 26)


def answers_of(path: Path, given: Mapping[str, str], ask: Ask) -> Answers:
    """Return all answers about the robot that `path` will describe.

    Answers in `given` are not asked again; raises BadInputError if one of them is invalid.
    """
    first = kind_question()
    answers: Answers = {first.key: _answer(first, {}, given, ask)}
    kind = answers["kind"]
    asked = questions(path.parent, path.stem, kind)
    nowhere = (0.0,) * kind.size
    last = [q.key for q in places(kind, nowhere, nowhere, proposed_stand)]
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
        answers[question.key] = _answer(question, answers, given, ask)
    for question in places(kind, *proposed_box(answers), proposed_stand):
        answers[question.key] = _answer(question, answers, given, ask)
    return answers


def _answer(question: Question, answers: Answers, given: Mapping[str, str], ask: Ask) -> object:
    default, problem = question.default(answers), ""
    while True:
        text = given.get(question.key)
        if text is None:
            text = ask(question, default, problem)
        try:
            return question.read(text, answers)
        except AnswerError as error:
            problem = f"value {text!r}; {error}"
            if question.key in given:
                raise BadInputError(f"--set {question.key}: {problem}") from None


def proposed_box(answers: Answers) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the largest box of targets that the cables can hold, to the cm, or a first guess.

    A gap below it, of a tenth or the depth of a turned platform, is left for the stand. Cables from
    above can lower a platform to the floor: its stand is higher, to leave room below. The box is
    smaller if the motors could not hold the platform continuously.
    """
    exits = np.array([answers[f"exit_{i + 1}_m"] for i in range(answers["kind"].cables)])
    least, most = exits.min(axis=0), exits.max(axis=0)
    stand_m = -math.inf
    if least[-1] > 0.5 * most[-1]:  # all cables come from above
        least[-1] = 0.0
        lowest_m = min(answers[f"anchor_{i + 1}_m"][-1] for i in range(answers["kind"].cables))
        stand_m = min(_STAND_SHARE * most[-1], _STAND_m) - min(lowest_m, 0.0)
    middle, size = 0.5 * (least + most), most - least
    around = Box(_point(least), _point(most))
    statics = _statics_of(answers, around)
    # if no box keeps the reserve at all orientations, take one that is at least held
    for found in (statics.largest_box(around), statics.largest_held(around)):
        if found is None:
            continue
        whole_m = found.high_m[-1] - found.low_m[-1]
        gap_m = max(_STAND_SHARE * whole_m, _lower_when_turned_m(answers, found))
        gap_m += max(stand_m - found.low_m[-1], 0.0)
        low = np.array(found.low_m) + gap_m * np.eye(len(size))[-1]
        low, high = np.ceil(100.0 * low) / 100.0, np.floor(100.0 * np.array(found.high_m)) / 100.0
        if (low < high).all():
            return _settled(answers, Box(*_bearable(answers, low, high)))
    aside = np.maximum(0.1 * size, 0.05)
    return _point(middle - aside), _point(middle + aside)


def _settled(answers: Answers, box: Box) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the largest box of targets inside, to the cm: the middle of the box has moved."""
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

    For a platform that turns freely it is where the cables turn it least: otherwise they might
    tilt it on its stand, and the lengths measured there would be wrong.
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
    cables = range(answers["kind"].cables)
    return Platform(
        mass_kg=answers["mass_kg"],
        home_m=_point(0.5 * (np.array(box.low_m) + box.high_m)),
        home_tolerance_m=0.05,
        workspace_min_m=box.low_m,
        workspace_max_m=box.high_m,
        speed_m_s=answers["speed_m_s"],
        acceleration_m_s2=answers["acceleration_m_s2"],
        exit_points_m=tuple(answers[f"exit_{i + 1}_m"] for i in cables),
        anchor_points_m=tuple(answers[f"anchor_{i + 1}_m"] for i in cables),
        workspace_angle_rad=answers.get("angle_deg", 0.0),
        angular_speed_rad_s=answers.get("angular_speed_deg_s", 0.0),
        angular_acceleration_rad_s2=answers.get("angular_acceleration_deg_s2", 0.0),
    )


def _point(point_m: FloatArray) -> tuple[float, ...]:
    return tuple(float(x) for x in point_m)


def write_robot(answers: Answers, path: Path) -> Robot:
    """Write the answers into a new file and return the robot that it describes.

    Raises BadInputError if the file exists or cannot be written, ProfileError if the robot is
    inconsistent or cannot work; the file is removed then.
    """
    text = text_of(answers)
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise BadInputError(f"{path}: already exists, and is not overwritten") from None
    except OSError as error:
        raise BadInputError(f"{path}: {error.strerror}") from None
    try:
        robot = load_robot(path)
        refuse_impossible(robot)
        return robot
    except ProfileError:
        path.unlink()
        raise


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
        what=KINDS[kind.name],
        buses=[answers["bus"], answers.get("bus_2")][: kind.buses],
        axes=axes,
        angle_deg=math.degrees(answers.get("angle_deg", 0.0)),
        speed_rad_s=_speed_limit(answers),
    )
    return "\n".join(map(_aligned, text.splitlines())) + "\n"


def _speed_limit(answers: Answers) -> float | None:
    """Return the shipped robot's motor speed limit if the new robot uses the same winch."""
    robot = answers["kind"].robot
    most = robot.limits.speed_rad_s
    if most is None or answers["winch"][0] != robot.axes[0].winch.profile:
        return None
    return float(most[0])


def _aligned(line: str) -> str:
    """Return a line with its comment aligned with those of the other lines."""
    key, mark, said = line.partition("  # ")
    return f"{key:36}  # {said}" if mark else line
