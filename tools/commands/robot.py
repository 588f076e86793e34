"""`cdpr robot new|import|show|pose|mark-calibrated`: describe a cable robot, and show it."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from shlex import quote
from typing import Annotated

import numpy as np
import typer

from cdpr_drivers.bus.budget import machine_budget
from cdpr_drivers.robot.robot_buses import refusal
from cdpr_profiles import Robot, load_robot
from cdpr_profiles.calibration_in_force import load_calibrated
from cdpr_profiles.errors import printable
from cdpr_profiles.platform import NO_PLATFORM, Platform
from cdpr_rt import offline
from cdpr_rt.diagnosis import checks
from cdpr_rt.diagnosis.subject import Finding, Subject
from cdpr_rt.model.calibration_state import mark_calibrated
from cdpr_tools.commands.options import JsonOption, PngOption, RobotArgument, argument, option
from cdpr_tools.errors import BAD_INPUT, BadInputError, os_error_as
from cdpr_tools.output import Output, TableText, fold, width_of
from cdpr_tools.robots import new_robot, summary
from cdpr_tools.robots.calibration_text import calibration_lines
from cdpr_tools.robots.caspr import read_caspr
from cdpr_tools.robots.questions import KINDS, SKETCH, Default, Question
from cdpr_tools.streams import discard_typed_ahead

app = typer.Typer()


@app.command()
def show(robot: RobotArgument, png: PngOption = None, as_json: JsonOption = False) -> None:
    """Show a robot's platform, cables and workspace, and check whether it can work.

    The exit status is 2 if the robot cannot work.
    """
    out = Output(as_json)
    profile = load_calibrated(robot)
    platform = profile.platform
    if platform is None:
        raise BadInputError(
            f"{profile.path}: {NO_PLATFORM}; `cdpr profiles show` prints its other keys"
        )
    with out.stage(f"{profile.profile}: computing tensions and control, looking for problems"):
        subject = Subject(profile)
        figures = summary.figures(subject)
        found = [*checks.diagnose(profile), *_bus_findings(profile)]
    out.say(*summary.lines(subject, figures))
    known = profile.calibration
    figures["calibration"] = None if known is None else known.summary()
    if known is not None:
        out.say("", *calibration_lines(known, profile))
    if png is not None:
        _draw(profile, platform, png, out)
    out.say("")
    _say_findings(out, found)
    if not found:
        out.say("no problems found")
    figures["findings"] = [
        {"key": f.key, "text": f.text, "impossible": f.impossible} for f in found
    ]
    possible = not any(finding.impossible for finding in found)
    out.result({"ok": possible, **figures})
    if not possible:
        raise typer.Exit(BAD_INPUT)


def _bus_findings(profile: Robot) -> list[Finding]:
    """Return a finding if the cycle does not fit the buses, else an empty list."""
    reason = refusal(machine_budget(profile))
    return [Finding("sync_period_s", reason, impossible=True)] if reason else []


@app.command()
def pose(
    robot: RobotArgument,
    table: Annotated[
        Path,
        argument(
            "CSV with the columns length_1_m, length_2_m, ... and, if measured, tension_1_N, "
            "... at the winches, roll_rad and pitch_rad, time_s, and the pose: x_m y_m z_m, "
            "qw qx qy qz.",
            metavar="TABLE",
        ),
    ],
    poses: Annotated[
        Path | None, option("Write the poses, NAME.csv.", "--out", metavar="FILE")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Compute poses from a table of cable lengths, and their errors.

    The control computes them in the same way. Errors are shown if the table has measured poses.
    Lengths are those of the straight cables under load, with the parts on their pulleys.
    """
    from cdpr_tools.robots import pose_table  # noqa: PLC0415  # slow to load

    out = Output(as_json)
    model = offline.load(robot)
    given = pose_table.read_pose_table(table, model.n)
    with out.stage(f"{table.name}: computing {len(given.length_m)} poses"):
        found = pose_table.estimates(model, given)
    *_, (best, last) = found.items()
    lost = int(np.isnan(last).any(axis=1).sum())
    out.say(f"{table}: {len(last)} poses from {best}" + f", {lost} not found" * bool(lost))
    figures = {name: pose_table.errors(rows, given) for name, rows in found.items()}
    rows = [
        [name, what, *(f"{value:.2f}" for value in of_it.values())]
        for name, of_each in figures.items()
        for what, of_it in of_each.items()
    ]
    if rows:
        header = ["pose from", "error of", "mean", "rms", "largest"]
        out.say(TableText([header, *rows], left=("error of",)))
    swing = pose_table.swing(given)
    if swing:
        out.say(
            f"the platform swings by {swing['amplitude_deg']:.2f} deg with a period of "
            f"{swing['period_s']:.2f} s; `cdpr robot show` predicts the period"
        )
    if poses is not None:
        with os_error_as(BadInputError, str(poses)):
            pose_table.write_pose_table(poses, last)
        out.say(f"poses: {poses}")
    out.result(
        {"ok": not lost, "poses": len(last), "not_found": lost, "errors": figures, "swing": swing}
    )


@app.command("mark-calibrated")
def mark_calibrated_(
    robot: RobotArgument,
    why: Annotated[
        str, option("How the exit points in the robot's file were determined.", "--why")
    ],
    as_json: JsonOption = False,
) -> None:
    """Confirm the geometry in the robot's file, e.g. after moving a rail."""
    out = Output(as_json)
    state = mark_calibrated(load_robot(robot).profile, why)
    out.say(f"robot {state.robot}: calibrated since {state.date}: {state.why}")
    out.result({"ok": True, "calibration": asdict(state)})


@app.command()
def new(
    path: Annotated[Path, argument("The file to write, NAME.toml.", metavar="FILE")],
    answers: Annotated[
        list[str] | None,
        option(
            "Answer in advance, such as frame_m='3 2'; may be repeated. A wrong key lists "
            "all keys.",
            "--set",
            metavar="KEY=VALUE",
        ),
    ] = None,
    yes: Annotated[bool, option("Use the defaults for all other questions.", "--yes")] = False,
    png: PngOption = None,
    as_json: JsonOption = False,
) -> None:
    """Write a robot's file by answering questions.

    It describes robots in a plane and in space, with 3 to 8 cables. The first question lists the
    kinds and explains their numbers of cables. Each question has a default; most defaults follow
    from earlier answers. Never overwrites a file. If the robot cannot work, you are asked for other
    answers to the questions that matter. The file is written anyway, and you can edit it.
    """
    out = Output(as_json)
    _require_new(path)
    given = _given(answers or ())
    if "kind" not in given and not yes:
        typer.echo(SKETCH, err=True)
        for name, what in KINDS.items():
            typer.echo(f"{name:12} {what}", err=True)
    profile, found = _described(path, given, yes, out)
    _say_findings(out, found)
    if png is not None and profile.platform is not None:
        _draw(profile, profile.platform, png, out)
    out.say(f"next: cdpr robot show {path}")
    out.say(f"      cdpr run {path} --bus simbus:      # on simulated winches")
    out.result({"ok": True, "file": str(path)})


@app.command("import")
def import_(
    bodies: Annotated[Path, argument("The model's file of bodies, XML.", metavar="BODIES")],
    cables: Annotated[Path, argument("The model's file of cables, XML.", metavar="CABLES")],
    path: Annotated[Path, argument("The file to write, NAME.toml.", metavar="FILE")],
    answers: Annotated[
        list[str] | None,
        option(
            "Answer as for `cdpr robot new`, such as winch=NAME; may be repeated.",
            "--set",
            metavar="KEY=VALUE",
        ),
    ] = None,
    upright: Annotated[
        bool, option("Read a horizontal plane as an upright one, with gravity along -y.")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Write a robot's file from a CASPR model.

    Geometry, mass and tensions come from the model, all else from the defaults of `cdpr robot new`,
    but no turned targets. The platform's origin is its centre of mass. If the robot cannot work
    with its winches, the file is written anyway, and you can edit it.
    """
    out = Output(as_json)
    _require_new(path)
    given = _given(answers or ())
    ask = read_caspr(bodies, cables, upright=upright)
    complete = new_robot.answers_of(path, given, ask, out.stage)
    for note in ask.notes:
        out.say(f"not from the model: {note}")
    with out.stage("checking whether the robot can work"):
        profile, found = new_robot.write_robot(complete, path)
    wrong = [finding for finding in found if finding.impossible]
    if profile is None or wrong:
        raise BadInputError(_rejection(path, wrong))
    out.say(f"{path}: written")
    _say_findings(out, found)
    out.say(f"next: cdpr robot show {path}")
    out.result({"ok": True, "file": str(path), "not_from_model": ask.notes})


def _require_new(path: Path) -> None:
    if path.exists():
        raise BadInputError(f"{path}: already exists and is never overwritten; choose another name")
    if path.suffix != ".toml" or not path.parent.is_dir():
        raise BadInputError(f"{path}: allowed: NAME.toml in an existing folder")


def _rejection(path: Path, wrong: list[Finding]) -> str:
    """Return why the robot of a file that was written cannot work, and what to do."""
    return "\n".join(
        [
            f"{path}: written, but this robot cannot work",
            *(f"{finding.key}: {finding.text}" for finding in wrong),
            f"edit the file, then check it: cdpr robot show {path}",
        ]
    )


def _described(
    path: Path, given: dict[str, str], yes: bool, out: Output
) -> tuple[Robot, list[Finding]]:
    """Ask about a robot until it can work, and write its file; return it with its findings.

    Raises BadInputError if the questions are not all answered, or the last robot cannot work.
    """
    ask, before = _Asker(path, given, yes), None
    while True:
        complete = new_robot.answers_of(path, {} if ask.rejected else given, ask, out.stage)
        with out.stage("checking whether the robot can work"):
            profile, found = new_robot.write_robot(complete, path, over=ask.rejected)
        wrong = [finding for finding in found if finding.impossible]
        if profile is not None and not wrong:
            out.say(f"{path}: written")
            return profile, found
        keys = new_robot.questioned(wrong, complete, ask.typed)
        ask.reject(wrong, keys)
        if yes or not keys or complete == before:
            raise BadInputError(ask.rejection)
        before = complete


class _Asker:
    """Asks the questions at the terminal, or takes all defaults if `yes`.

    Once a robot was rejected, it asks only the questions that matter. The other typed answers stay,
    and the other defaults adapt.
    """

    def __init__(self, path: Path, given: dict[str, str], yes: bool) -> None:
        self._path, self._yes = path, yes
        self.typed = dict(given)
        """The answers that are not defaults, by key."""
        self.rejection = ""
        """Why the robot was rejected last, "" if it was not."""
        self._wanted: set[str] = set()
        self._origin = ""

    @property
    def rejected(self) -> bool:
        """Whether a robot was rejected, and its file written."""
        return bool(self.rejection)

    def reject(self, wrong: list[Finding], keys: set[str]) -> None:
        """Show why a robot cannot work, and ask for `keys` the next time."""
        reasons = [f"{finding.key}: {finding.text}" for finding in wrong]
        self.rejection = _rejection(self._path, wrong)
        self._wanted, self._origin = keys, ""
        if keys and not self._yes:
            _say("this robot cannot work:", *reasons, "another answer, please:")

    def __call__(self, question: Question, default: Default, problem: str) -> str:
        """Return the answer to a question; raises BadInputError if none was given."""
        key = question.key
        if self._yes and problem:
            raise BadInputError(f"{key}: {problem}; answer it with --set")
        if not problem and (self._yes or (self.rejected and key not in self._wanted)):
            return self.typed.get(key, default.text)
        if problem:
            _say(f"  {problem}")
        elif default.origin not in ("", self._origin):
            _say(f"  default: {default.origin}")
        self._origin = default.origin
        discard_typed_ahead()
        try:
            text = str(
                typer.prompt(_fitted(question.text, default), default=default.text, err=True)
            )
        except typer.Abort:
            typer.echo(err=True)  # end the line of the question
            raise BadInputError(self.rejection or self._unfinished(key)) from None
        self.typed.pop(key, None)
        if text != default.text:
            self.typed[key] = text
        return text

    def _unfinished(self, key: str) -> str:
        options = " ".join(f"--set {quote(f'{key}={text}')}" for key, text in self.typed.items())
        again = " ".join(["cdpr robot new", quote(str(self._path)), options])
        return (
            f"no answer to {key!r} (--yes takes the defaults); nothing was written\n"
            f"to continue: {again.rstrip()}"
        )


def _say(*lines: str) -> None:
    for line in lines:
        typer.echo(fold(printable(line), width_of(sys.stderr)), err=True)


def _fitted(text: str, default: Default) -> str:
    """Return a question, folded so that its default and an answer as long fit beside its end."""
    width = width_of(sys.stderr)
    return fold(text, width and max(width - 2 * len(default.text) - len(" []: "), _LEAST_QUESTION))


_LEAST_QUESTION = 40
"""Columns that a question gets on any terminal."""


def _given(answers: Sequence[str]) -> dict[str, str]:
    given: dict[str, str] = {}
    for key, value in map(_key_and_value, answers):
        if key in given:
            raise BadInputError(f"--set {key}: given as {given[key]!r} and {value!r}; give it once")
        given[key] = value
    return given


def _key_and_value(text: str) -> tuple[str, str]:
    key, equals, value = text.partition("=")
    if not equals:
        raise BadInputError(f"--set {text}: allowed: KEY=VALUE")
    return key.strip(), value.strip()


def _say_findings(out: Output, found: list[Finding]) -> None:
    for finding in found:
        kind = "impossible" if finding.impossible else "warning"
        out.say(f"{kind}: {finding.key}: {finding.text}")


def _draw(profile: Robot, platform: Platform, path: Path, out: Output) -> None:
    from cdpr_tools.robots.picture import draw_robot  # noqa: PLC0415  # slow to load

    with out.stage(f"{path.name}: drawing the workspace"):
        draw_robot(profile, platform, path)
    out.say(f"\npicture: {path}")
