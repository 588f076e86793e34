"""`cdpr robot trial`: try a whole robot on its simulator and judge it by what was true."""

from __future__ import annotations

import time
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from profiles import load_robot
from tools.commands.options import JsonOption
from tools.errors import BadInputError
from tools.output import Output


class KindOfTrial(StrEnum):
    """What the robot is to do."""

    TARGETS = "targets"
    LINE = "line"
    RANDOM = "random"
    STREAM = "stream"


def add(parent: typer.Typer) -> None:
    """Add the command."""
    parent.command("trial")(trial)


def trial(
    robot: Annotated[
        str, typer.Argument(help="Robot profile: a name or the path of a file.", metavar="ROBOT")
    ],
    kind: Annotated[
        KindOfTrial,
        typer.Argument(
            help="targets: accuracy at rest; line: 10 mm/s with compensation and without; random: "
            "targets at the limits; stream: a hand that leads through a bad network."
        ),
    ],
    plant: Annotated[
        Path | None, typer.Option(help="Plant file: the truth about robot, cables and motors.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Of all that is left to chance.")] = 1,
    minutes: Annotated[
        float | None,
        typer.Option(min=0.05, max=600.0, help="How long, in the robot's time; not for line."),
    ] = None,
    commissioned: Annotated[
        Path | None,
        typer.Option(help="Folder that `cdpr commission ROBOT` has left.", metavar="DIR"),
    ] = None,
    without_compensation: Annotated[
        bool, typer.Option("--without-compensation", help="Use nothing learnt of the motors.")
    ] = False,
    out_dir: Annotated[
        Path | None,
        typer.Option(
            "--out", help="New folder for recordings, true poses and picture.", metavar="DIR"
        ),
    ] = None,
    again: Annotated[
        bool, typer.Option("--again", help="Judge what --out holds once more; nothing moves.")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Try a robot on a simulator of its own; the figures come from what was recorded and true.

    Every cycle crosses the simulated bus to the daemon's own loop, in bus time: ten minutes take a
    few. Ends with exit status 0 once it has judged, whether all that is wanted is reached or not.
    """
    from tools.trials import trial as trials  # noqa: PLC0415  # slow to load

    out = Output(as_json)
    if again:
        if out_dir is None:
            raise BadInputError("--again: needs --out, the folder of a trial that was run")
        result = trials.judge(out_dir)
        if result["kind"] != kind.value:
            raise BadInputError(f"{out_dir}: holds a trial of {result['kind']}, not {kind}")
    else:
        profile = load_robot(robot)
        name = f"trial-{profile.profile}-{kind}-{time.strftime('%Y%m%d-%H%M%S')}"
        folder = out_dir or Path("out") / name
        usual = trials.KINDS[kind]
        if minutes is not None and usual.fixed:
            raise BadInputError(f"--minutes {minutes:g}: {kind} lasts as long as it lasts")
        asked = trials.Asked(
            kind=kind.value,
            robot=robot,
            plant=None if plant is None else str(plant.absolute()),
            seed=seed,
            minutes=usual.minutes if minutes is None else minutes,
            commissioned=None if commissioned is None else str(commissioned.absolute()),
            compensated=not without_compensation,
        )
        result = trials.perform(asked, folder, out)
    for line in result.pop("lines"):
        out.say(line)
    out.say(f"picture: {result['picture']}")
    out.result({"ok": True, **result})
