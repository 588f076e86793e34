"""A process that describes robots for a daemon's page: a line of JSON in, a line of JSON out."""

from __future__ import annotations

import json
import math
import re
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

from cdpr_drivers.bus.budget import machine_budget
from cdpr_drivers.robot.robot_buses import refusal
from cdpr_profiles import Robot, load_robot
from cdpr_profiles.bounded_input import replacing
from cdpr_profiles.errors import ProfileError
from cdpr_profiles.places import SHIPPED, profile_files, user_folder
from cdpr_profiles.user_folders import can_write
from cdpr_rt.diagnosis.checks import diagnose
from cdpr_rt.diagnosis.predictions import lowest_resonance_Hz
from cdpr_rt.diagnosis.subject import Finding, Subject
from cdpr_rt.errors import ControlError
from cdpr_tools.errors import BadInputError, CommandError
from cdpr_tools.output import to_json
from cdpr_tools.robots.caspr import kind_of_points
from cdpr_tools.robots.new_robot import answers_of, text_of
from cdpr_tools.robots.questions import KINDS, Answers, Default, Question

_NAME: Final = re.compile("[a-z0-9][a-z0-9_-]{0,39}")


def main() -> None:
    """Answer requests until standard input ends."""
    for line in sys.stdin:
        try:
            answer = _answered(json.loads(line))
        except (CommandError, ProfileError, ControlError) as error:
            answer = {"error": str(error)}
        except OSError as error:
            answer = {"error": f"{error.filename or 'the file'}: {error.strerror}"}
        print(to_json(answer), flush=True)


def _answered(request: Mapping[str, Any]) -> dict[str, Any]:
    typed, notes = dict(request["answers"]), list[str]()
    if request.get("present"):
        typed, notes = answers_from(load_robot(request["present"]))
    form = _Form(typed)
    # profiles that the file names are searched where the file will be
    answers = answers_of(_file("robot"), {}, form)
    if "name" in request:
        return _saved(answers, form, str(request["name"]), replace=bool(request.get("replace")))
    text = text_of(answers)
    if request["diagnose"]:
        return _diagnosed(text)
    return {
        "questions": list(form.fields.values()),
        "toml": text,
        "platform": _platform(answers),
        "notes": notes,
        "folder": str(_file("").parent),
        "writable": can_write(_file("").parent),
    }


class _Form:
    """Answers questions from a form; an invalid answer is noted, and the default replaces it."""

    def __init__(self, typed: Mapping[str, str]) -> None:
        self._typed = typed
        self.fields: dict[str, dict[str, Any]] = {}

    def __call__(self, question: Question, default: Default, problem: str) -> str:
        """Return the answer to a question."""
        text = self._typed.get(question.key, "").strip() or default.text
        if question.key == "winch" and "/" in text:
            problem = "allowed: the name of a profile"
        self.fields[question.key] = {
            "key": question.key,
            "text": question.text,
            "value": text,
            "default": default.text,
            "origin": default.origin,
            "problem": problem,
            "choices": _choices(question.key),
        }
        return default.text if problem else text

    @property
    def problem(self) -> str:
        """The first problem, "" without one."""
        return next(
            (f"{f['key']}: {f['problem']}" for f in self.fields.values() if f["problem"]), ""
        )


def _choices(key: str) -> list[str]:
    if key == "kind":
        return list(KINDS)
    return sorted({path.stem for path in profile_files("winches")}) if key == "winch" else []


def _diagnosed(text: str) -> dict[str, Any]:
    robot, found = _checked(text)
    return {
        "findings": [
            {"key": one.key, "text": one.text, "impossible": one.impossible} for one in found
        ],
        "figures": {} if robot is None else _figures(robot),
    }


def _checked(text: str) -> tuple[Robot | None, list[Finding]]:
    """Return the robot of a file's text, None if it cannot be read, and what is wrong with it."""
    with tempfile.TemporaryDirectory(prefix="cdpr-robot-") as folder:
        path = Path(folder) / "robot.toml"
        path.write_text(text, encoding="utf-8")
        try:
            robot = load_robot(path)
        except ProfileError as error:
            return None, [Finding(error.key, error.problem, impossible=True)]
        reason = refusal(machine_budget(robot))
        found = [Finding("sync_period_s", reason, impossible=True)] if reason else []
        return robot, [*found, *diagnose(robot)]


def _platform(answers: Answers) -> dict[str, Any]:
    """Return what the page draws, as in the description of a running robot."""
    cables = range(1, answers["kind"].cables + 1)
    return {
        "exit_points_m": [answers[f"exit_{i}_m"] for i in cables],
        "anchor_points_m": [answers[f"anchor_{i}_m"] for i in cables],
        "home_m": answers["home_m"],
        "workspace_min_m": answers["low_m"],
        "workspace_max_m": answers["high_m"],
        "workspace_angle_rad": answers.get("angle_deg", 0.0),
        "controlled": answers["kind"].platform.controlled,
        "speed_m_s": answers["speed_m_s"],
        "body": None,
        "obstacles": [],
        "poses_m": {},
    }


def _figures(robot: Robot) -> dict[str, Any]:
    """Return the figures of `cdpr robot show` that take little time."""
    try:
        s = Subject(robot)
        statics, points = s.statics, s.statics.points()
        turns = statics.orientations
        still = np.array([statics.margin_N(points, 0.0, turn) for turn in turns])
        acceleration = s.platform.acceleration_m_s2
        moving = np.array([statics.margin_N(points, acceleration, turn) for turn in turns])
        lengths = np.array([statics.lengths(points, turn) for turn in turns])
        return {
            "held_share": float(np.mean(still >= 0.0)),
            "target_share": float(np.mean(moving >= statics.model.reserve_N)),
            "lowest_resonance_Hz": float(lowest_resonance_Hz(s.model, s.axes, points).min()),
            "longest_cable_m": float(lengths.max()),
        }
    except ControlError:
        return {}


# Save a description as the user's own profile.


def _file(name: str) -> Path:
    return user_folder() / "robots" / f"{name}.toml"


def _saved(answers: Answers, form: _Form, name: str, *, replace: bool) -> dict[str, Any]:
    if not _NAME.fullmatch(name):
        raise BadInputError(
            f"name {name!r}; allowed: up to 40 lower-case letters, digits, - and _, the first a "
            "letter or digit"
        )
    if form.problem:
        raise BadInputError(f"{form.problem}; nothing was saved")
    if (SHIPPED / "robots" / f"{name}.toml").exists():
        raise BadInputError(f"name {name!r}: a shipped robot has this name; choose another")
    path = _file(name)
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.exists() and not replace:
        raise BadInputError(f"{path}: already exists; confirm that it is to be replaced")
    with replacing(path) as file:
        file.write(text_of(answers).encode())
    return {"file": str(path)}


# Start from a robot that exists.


def answers_from(robot: Robot) -> tuple[dict[str, str], list[str]]:
    """Return a robot as answers, and what they leave out; raises BadInputError for other kinds."""
    platform, limits, axes = robot.platform, robot.limits, robot.axes
    if platform is None:
        raise BadInputError(f"{robot.profile} has no platform; start from a new robot")
    exits, anchors = np.array(platform.exit_points_m), np.array(platform.anchor_points_m)
    answers = {
        "kind": kind_of_points(exits, anchors, robot.path),
        "name": robot.name,
        "winch": axes[0].winch.profile,
        "nodes": ", ".join(str(axis.node_id) for axis in axes),
        "mass_kg": f"{platform.mass_kg:.6g}",
        "acceleration_m_s2": f"{platform.acceleration_m_s2:.6g}",
        "speed_m_s": f"{platform.speed_m_s:.6g}",
        "low_m": _text(platform.workspace_min_m),
        "high_m": _text(platform.workspace_max_m),
        "home_m": _text(platform.home_m),
        "angle_deg": f"{math.degrees(platform.workspace_angle_rad):.6g}",
        "angular_speed_deg_s": f"{math.degrees(platform.angular_speed_rad_s):.6g}",
        "angular_acceleration_deg_s2": (
            f"{math.degrees(platform.angular_acceleration_rad_s2):.6g}"
        ),
    }
    for key, bus in zip(("bus", "bus_2"), robot.buses, strict=False):
        answers[key] = bus.url or ""
    for i in range(len(axes)):
        answers[f"exit_{i + 1}_m"] = _text(platform.exit_points_m[i])
        answers[f"anchor_{i + 1}_m"] = _text(platform.anchor_points_m[i])
    for key in ("torque_Nm", "tension_min_N", "tension_max_N"):
        if values := getattr(limits, key):
            answers[key] = f"{values[0]:.6g}"
    return answers, _left_out(robot)


def _left_out(robot: Robot) -> list[str]:
    platform = robot.platform
    assert platform is not None
    there = {
        "winches that differ between axes": len({a.winch.reference for a in robot.axes}) > 1,
        "safety_io": robot.safety_io is not None,
        "tension_sensors": robot.tension_sensors is not None,
        "rails": bool(robot.rails),
        "the body and obstacles": platform.body is not None or bool(platform.obstacles),
        "named poses": bool(platform.poses_m),
        "pulleys": any(platform.pulley_radius_m),
        "the rotation at home": any(platform.home_rotation_rad),
    }
    return [what for what, is_there in there.items() if is_there]


def _text(point_m: tuple[float, ...]) -> str:
    return ", ".join(f"{round(value, 4) + 0.0:g}" for value in point_m)


if __name__ == "__main__":
    main()
