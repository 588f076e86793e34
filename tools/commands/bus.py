"""`cdpr bus`: look at a CAN bus: who is there, what is said, whether it fits."""

from __future__ import annotations

import typer

from tools.commands import bus_budget

app = typer.Typer(help="Look at a CAN bus.", no_args_is_help=True)


def register(parent: typer.Typer) -> None:
    """Add the command group."""
    bus_budget.add(app)
    parent.add_typer(app, name="bus")


@app.callback()
def _group() -> None:
    """Look at a CAN bus."""
