"""Masses on a cable: hung by a person on request, or by the simulator's physics board."""

from __future__ import annotations

import os
import signal
import sys
from functools import partial
from pathlib import Path

import typer

from cdpr_rt.core.clock import Clock
from cdpr_rt.procedures.tension.masses import Hang, not_hung
from cdpr_sim_bus.physics_board import PhysicsBoard


def by_prompt(mass_kg: float, clock: Clock) -> None:
    """Ask the person at the winch; the drive has no power, so Ctrl-C may end it here at once.

    Only Enter alone raises the mass: who types a word wants something else.
    """
    ending = (signal.SIGINT, signal.SIGTERM)
    question = (
        f"Hang {mass_kg:g} kg on the cable, standing on its support, take up the slack, and "
        "press Enter (Ctrl-C ends)"
    )
    before = {number: signal.signal(number, signal.default_int_handler) for number in ending}
    try:
        # a person takes their time; the safety I/O is asked meanwhile
        while clock.run_blocking(partial(_typed, question)):
            typer.echo("Enter alone, please.", err=True)
    except (EOFError, KeyboardInterrupt):
        raise not_hung(mass_kg) from None
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _typed(question: str) -> str:
    """Ask, and return the line that is typed; raises EOFError where no more can come.

    Not by `input`: a thread that is still there when the process ends would hold the buffer's lock.
    """
    typer.echo(f"{question}: ", nl=False, err=True)
    line = b""
    while not line.endswith(b"\n"):
        byte = os.read(sys.stdin.fileno(), 1)
        if not byte:
            raise EOFError
        line += byte
    return line.decode(errors="replace").strip()


def on_board(board: Path) -> Hang:
    """Return what hangs masses on the first cable of a simulator, by its physics board."""

    def hang(mass_kg: float, _: Clock) -> None:
        with PhysicsBoard.attach(board) as shared:
            shared.axis(0).hung_mass_kg = mass_kg

    return hang
