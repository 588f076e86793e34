"""`cdpr robot`: describe a cable robot, look at it, try it."""

from __future__ import annotations

import typer

app = typer.Typer(help="Describe a cable robot, look at it, try it.", no_args_is_help=True)


def register(parent: typer.Typer) -> None:
    """Add the command group."""
    parent.add_typer(app, name="robot")


@app.callback()
def _group() -> None:
    """Describe a cable robot, look at it, try it."""
