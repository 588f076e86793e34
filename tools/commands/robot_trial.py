"""`cdpr robot trial`: try a whole robot on its simulator and judge it against the truth."""

from __future__ import annotations

import time
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from cdpr_profiles import load_robot
from cdpr_tools.commands import options
from cdpr_tools.commands.options import argument, option
from cdpr_tools.composition.own_code import OwnCodeOptions
from cdpr_tools.errors import BadInputError
from cdpr_tools.output import Output
from cdpr_tools.signals import interrupted_by_sigterm


class KindOfTrial(StrEnum):
    """The task of the robot."""

    TARGETS = "targets"
    LINE = "line"
    RANDOM = "random"
    STREAM = "stream"
    PATH = "path"
    TAPE = "tape"


app = typer.Typer()


@app.command()
def trial(
    robot: options.RobotArgument,
    kind: Annotated[
        KindOfTrial,
        argument(
            "targets: accuracy at rest; line: lines and turns with and without "
            "compensation; random: targets at full speed; path: lines, arcs and cut "
            "corners of a G-code file; stream: set-points of a hand over a bad network; "
            "tape: exit points that differ from the robot's file by 20 to 50 mm."
        ),
    ],
    plant: options.RobotPlantOption = None,
    seed: options.SeedOption = 1,
    minutes: Annotated[
        float | None, option("Duration in bus time; not for line.", min=0.05, max=600.0)
    ] = None,
    speed_mm_s: Annotated[
        float | None, option("Speed; default: 10 for lines, the robot's for a path.", min=0.1)
    ] = None,
    commissioned: options.CommissionedOption = None,
    controller: options.ControllerOption = None,
    tension_distribution: options.TensionDistributionOption = None,
    allow_code: options.AllowCodeOption = False,
    without_compensation: Annotated[
        bool, option("Do not use commissioning results.", "--without-compensation")
    ] = False,
    out_dir: Annotated[
        Path | None,
        option("New folder for recordings, true poses and picture.", "--out", metavar="DIR"),
    ] = None,
    again: options.AgainOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """Try a robot in simulation and judge its accuracy against the truth.

    The daemon's own loop runs over the simulated bus in lockstep, faster than real time. The exit
    status is 0 even if a figure misses its limit.
    """
    from cdpr_tools.trials import trial as trials  # noqa: PLC0415  # slow to load

    out = Output(as_json)
    if again:
        if out_dir is None:
            raise BadInputError("--again: needs --out, the folder of a finished trial")
        result = trials.judge(out_dir)
        if result["kind"] != kind.value:
            raise BadInputError(f"{out_dir}: contains a trial of {result['kind']}, not {kind}")
    else:
        profile = load_robot(robot)
        name = f"trial-{profile.profile}-{kind}-{time.strftime('%Y%m%d-%H%M%S')}"
        folder = out_dir or Path("out") / name
        if folder.exists() and any(folder.iterdir()):
            raise BadInputError(f"--out {folder}: is not empty; choose a new folder")
        default = trials.KINDS[kind]
        own = OwnCodeOptions(controller, tension_distribution)
        own.require_use(profile, allow_code=allow_code)
        if minutes is not None and default.at_speed:
            raise BadInputError(f"--minutes {minutes:g}: the duration of {kind} cannot be set")
        if speed_mm_s is not None and not default.at_speed:
            raise BadInputError(f"--speed-mm-s {speed_mm_s:g}: allowed only with line and path")
        if speed_mm_s is None and kind is KindOfTrial.PATH and profile.platform is not None:
            speed_mm_s = 1e3 * profile.platform.speed_m_s
        settings = trials.TrialSettings(
            kind=kind.value,
            robot=robot,
            plant=None if plant is None else str(plant.absolute()),
            seed=seed,
            minutes=default.minutes if minutes is None else minutes,
            commissioned=None if commissioned is None else str(commissioned.absolute()),
            compensated=not without_compensation,
            own=own,
            **({} if speed_mm_s is None else {"speed_m_s": 1e-3 * speed_mm_s}),
        )
        with interrupted_by_sigterm():
            result = trials.perform(settings, folder, out)
    out.say(*result.pop("lines"))
    out.say(f"picture: {result['picture']}")
    out.result({"ok": True, **result})
