"""`cdpr bus`: look at a CAN bus: who is there, what is said, whether it fits."""

from __future__ import annotations

import typer

app = typer.Typer(help="Look at a CAN bus.", no_args_is_help=True)


def register(parent: typer.Typer) -> None:
    """Add the command group."""
    parent.add_typer(app, name="bus")


@app.callback()
def _group() -> None:
    """Look at a CAN bus."""
