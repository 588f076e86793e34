"""`cdpr sim`: simulated drives on a bus of their own or on a real one."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tools.errors import BadInputError
from drivers.bus.url import BusUrl

app = typer.Typer(help="Simulated winches on a CAN bus.", no_args_is_help=True)


def register(parent: typer.Typer) -> None:
    """Add the command group."""
    parent.add_typer(app, name="sim")
