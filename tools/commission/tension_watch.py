"""Show cable tensions live: bars at a terminal, figures at the end."""

from __future__ import annotations

import os
import select
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import typer
from rich.console import Group
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table

from cdpr_drivers.modbus.tension import TensionSampler
from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.clock import Clock
from cdpr_rt.core.exchange import TensionFault
from cdpr_sim_bus.physics_board import PhysicsBoard
from cdpr_tools.commission.tension_calibration import Hang, not_hung
from cdpr_tools.output import Output
from cdpr_tools.signals import stop_on_signals
from cdpr_tools.streams import discard_typed_ahead

_LOOK_S = 0.02
_SHOW_HZ = 8.0
_LEAST_SCALE_N = 50.0


class _Sums:
    """Statistics of every new valid reading."""

    def __init__(self, n: int) -> None:
        self._seen: FloatArray = np.full(n, -np.inf)
        self.values: list[list[float]] = [[] for _ in range(n)]

    def update(self, sampler: TensionSampler) -> None:
        feedback = sampler.exchange.feedback
        for i in np.flatnonzero(feedback.valid & (feedback.time_s > self._seen)):
            self.values[i].append(float(feedback.tension_N[i]))
            self._seen[i] = feedback.time_s[i]


def watch(
    sampler: TensionSampler,
    clock: Clock,
    out: Output,
    seconds: float,
    stop_requested: Callable[[], bool],
) -> list[dict[str, Any]]:
    """Watch the tensions for `seconds`, or until a stop is requested; return their figures."""
    exchange = sampler.exchange
    sums = _Sums(exchange.n)
    begun_s = shown_s = clock.now_s
    highest = _LEAST_SCALE_N
    live = Live(console=out.notes, refresh_per_second=_SHOW_HZ, transient=True)
    with live:
        while clock.now_s < begun_s + seconds and not stop_requested():
            clock.sleep(_LOOK_S)
            exchange.update()
            sums.update(sampler)
            feedback = exchange.feedback
            highest = float(np.max(feedback.tension_N, where=feedback.valid, initial=highest))
            if clock.now_s > shown_s + 1.0 / _SHOW_HZ:
                shown_s = clock.now_s
                live.update(_table(sampler, highest))
    elapsed_s = clock.now_s - begun_s
    return [_figures(sampler, i, sums.values[i], elapsed_s) for i in range(exchange.n)]


def _table(sampler: TensionSampler, highest_N: float) -> Group:
    exchange, feedback = sampler.exchange, sampler.exchange.feedback
    table = Table(box=None)
    for title in ("cable", "N", "", "age ms", ""):
        table.add_column(title, justify="right" if title in ("N", "age ms") else "left")
    for i, cable in enumerate(exchange.cables):
        valid = bool(feedback.valid[i])
        bar = ProgressBar(total=highest_N, completed=max(0.0, float(feedback.tension_N[i])))
        table.add_row(
            cable,
            f"{feedback.tension_N[i]:.1f}" if valid else "-",
            bar if valid else "",
            f"{1e3 * feedback.age_s[i]:.0f}" if np.isfinite(feedback.age_s[i]) else "-",
            "" if valid else TensionFault(int(feedback.fault[i])).label,
        )
    errors = dict.fromkeys(error for error in sampler.errors if error)
    return Group(table, *errors)


def _figures(
    sampler: TensionSampler, i: int, values: list[float], elapsed_s: float
) -> dict[str, Any]:
    feedback = sampler.exchange.feedback
    read = np.array(values) if values else np.full(1, np.nan)
    return {
        "cable": sampler.exchange.cables[i],
        "valid": bool(feedback.valid[i]),
        "fault": TensionFault(int(feedback.fault[i])).label,
        "error": sampler.errors[i],
        "readings": len(values),
        "rate_Hz": len(values) / elapsed_s,
        "mean_N": float(read.mean()),
        "std_N": float(read.std()),
        "lowest_N": float(read.min()),
        "highest_N": float(read.max()),
        "age_s": float(feedback.age_s[i]),
    }


# Masses on a cable: hung by a person on request, or through the simulator's physics board.

_POLL_S = 0.05


def by_prompt(mass_kg: float, clock: Clock) -> None:
    """Ask the person at the winch; the drive has no power, so Ctrl-C may end this immediately.

    Only an empty line raises the mass, because a person who types a word wants something else.
    """
    question = (
        f"Hang {mass_kg:g} kg on the cable while the mass stands on its support, take up the "
        "slack, and press Enter (Ctrl-C ends)"
    )
    with stop_on_signals() as stop_requested:
        stop_requested.closing()  # a second Ctrl-C has nothing else to end
        # a person may take long; the safety I/O is monitored meanwhile
        while (
            line := clock.run_blocking(partial(typed_line, question, stop_requested))
        ).strip() and line.endswith("\n"):
            typer.echo("Press only Enter.", err=True)
    if stop_requested() or not line.endswith("\n"):
        raise not_hung(mass_kg)


def typed_line(question: str, stop_requested: Callable[[], bool]) -> str:
    """Ask, and return the typed line, or part of it if the input ends or a stop is requested.

    A request to stop cannot interrupt `input`, so it is not used.
    """
    discard_typed_ahead()
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
    """Return a function that hangs masses on a simulator's first cable, through its board."""

    def hang(mass_kg: float, _: Clock) -> None:
        with PhysicsBoard.attach(board) as shared:
            shared.axis(0).hung_mass_kg = mass_kg

    return hang
