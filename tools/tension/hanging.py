"""Masses on a cable: hung by a person on request, or by the simulator's physics board."""

from __future__ import annotations

import os
import select
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

import typer

from cdpr_rt.core.clock import Clock
from cdpr_rt.procedures.tension.masses import Hang, not_hung
from cdpr_sim_bus.physics_board import PhysicsBoard
from cdpr_tools.signals import stop_on_signals

_POLL_S = 0.05


def by_prompt(mass_kg: float, clock: Clock) -> None:
    """Ask the person at the winch; the drive has no power, so Ctrl-C may end it here at once.

    Only Enter alone raises the mass: who types a word wants something else.
    """
    question = (
        f"Hang {mass_kg:g} kg on the cable, standing on its support, take up the slack, and "
        "press Enter (Ctrl-C ends)"
    )
    with stop_on_signals() as stop_requested:
        stop_requested.closing()  # a second Ctrl-C has nothing else to end
        # a person takes their time; the safety I/O is asked meanwhile
        while (
            line := clock.run_blocking(partial(_typed, question, stop_requested))
        ).strip() and line.endswith("\n"):
            typer.echo("Enter alone, please.", err=True)
    if stop_requested() or not line.endswith("\n"):
        raise not_hung(mass_kg)


def _typed(question: str, stop_requested: Callable[[], bool]) -> str:
    """Ask, and return what is typed: a line, or less where no more can come or none is wanted.

    Not by `input`, which no question can end.
    """
    typer.echo(f"{question}: ", nl=False, err=True)
    line = b""
    while not line.endswith(b"\n") and not stop_requested():
        if select.select([sys.stdin], [], [], _POLL_S)[0]:
            byte = os.read(sys.stdin.fileno(), 1)
            if not byte:
                break
            line += byte
    return line.decode(errors="replace")


def on_board(board: Path) -> Hang:
    """Return what hangs masses on the first cable of a simulator, by its physics board."""

    def hang(mass_kg: float, _: Clock) -> None:
        with PhysicsBoard.attach(board) as shared:
            shared.axis(0).hung_mass_kg = mass_kg

    return hang
