"""Options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tools.finding_index import Index

WinchArgument = Annotated[
    str, typer.Argument(help="Winch profile: a name or the path of a file.", metavar="WINCH")
]
BusOption = Annotated[
    str,
    typer.Option(
        "--bus",
        help="simbus: (starts a simulated drive of its own), simbus:NAME, socketcan:can0, ...",
        metavar="URL",
    ),
]
PlantOption = Annotated[
    Path | None,
    typer.Option("--plant", help="Plant file for the simulated drive that `simbus:` starts."),
]
JsonOption = Annotated[
    bool, typer.Option("--json", help="End with one JSON line on standard output.")
]
YesOption = Annotated[
    bool, typer.Option("--yes", help="Do not ask before a real motor is energised.")
]

IndexOption = Annotated[
    Index,
    typer.Option(
        "--index",
        help="Find the encoder index by homing, or by the touch probe in ordinary motion.",
    ),
]

SafetyIoOption = Annotated[
    str | None,
    typer.Option(
        "--safety-io",
        help="Safety I/O without which there is no power: a name, a file, NAME@HOST:PORT.",
        metavar="IO",
    ),
]

SensorsOption = Annotated[
    str | None,
    typer.Option(
        "--sensors",
        help="Tension sensors, a name or a file: too much tension or none known stops the motion.",
        metavar="SENSORS",
    ),
]
SensorsPortOption = Annotated[
    str | None, typer.Option("--port", help="Serial port of the tension sensors' line.")
]
