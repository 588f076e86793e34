"""`cdpr sim verify`: run a command several times and see whether it writes the same."""

from __future__ import annotations

import os
import random
import tempfile
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer

from tools.commands.options import JsonOption
from tools.errors import BadInputError, WorkFailedError
from tools.output import Output
from tools.repeat.compare import Verdict, compare
from tools.repeat.disturbance import Stops
from tools.repeat.run import Run, perform
from tools.signals import stop_on_signals

_SEEDS = 2**31


def add(app: typer.Typer) -> None:
    """Add the command to the group `sim`."""
    app.command("verify")(verify)


def verify(
    command: Annotated[
        list[str],
        typer.Argument(
            help="After --: what would stand after `cdpr`, or a program by its path, with a /.",
            metavar="-- COMMAND...",
        ),
    ],
    runs: Annotated[int, typer.Option(min=2, max=1000, help="How often it is run.")] = 2,
    seed: Annotated[
        int | None, typer.Option(min=0, help="Of the disturbances; any where left out.")
    ] = None,
    busy: Annotated[
        int | None,
        typer.Option(min=0, help="Busy processes beside; one more than cores where left out."),
    ] = None,
    keep: Annotated[
        Path | None, typer.Option(help="New folder for all that is written.", metavar="DIR")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Run a command on simulated drives several times; exit status 1 where files differ.

    The first run is left alone. The others run beside busy processes, and one of their own
    processes after the other is stopped for 0.1 to 5 s. Each has an empty working folder.
    """
    out = Output(as_json)
    chosen = random.randrange(_SEEDS) if seed is None else seed
    besides = (os.cpu_count() or 1) + 1 if busy is None else busy
    out.say(f"seed of the disturbances: {chosen}")
    with ExitStack() as stack:
        folder = _new(keep) if keep is not None else Path(stack.enter_context(_passing()))
        stop_requested = stack.enter_context(stop_on_signals())
        done: list[Run] = []
        for number in range(1, runs + 1):
            stops = Stops(random.Random(f"{chosen} {number}")) if done else None
            beside = besides if done else 0
            done.append(perform(command, folder, number, stops, beside, stop_requested))
            out.note(_run_line(done[-1], beside))
            _check(done[-1])
        verdicts = compare(done)
    same = _tell(out, done, verdicts)
    out.result(
        {
            "ok": same,
            "command": command,
            "seed": chosen,
            "busy": besides,
            "folder": None if keep is None else str(folder),
            "runs": [
                {"seconds": run.seconds, "stops": run.stops, "held_s": run.held_s} for run in done
            ],
            "files": [verdict.told() for verdict in verdicts],
        }
    )
    if not same:
        raise typer.Exit(WorkFailedError.exit_status)


def _tell(out: Output, runs: Sequence[Run], verdicts: Sequence[Verdict]) -> bool:
    """Write the verdicts; return whether all is the same. Raises WorkFailedError without any."""
    if not any(verdict.same is not None for verdict in verdicts):
        raise WorkFailedError("the command wrote no file that is compared")
    for verdict in verdicts:
        out.say(verdict.line())
    same = all(verdict.same is not False for verdict in verdicts)
    out.say(f"{len(runs)} runs: {'the same' if same else 'NOT the same'}")
    return same


def _passing() -> tempfile.TemporaryDirectory[str]:
    return tempfile.TemporaryDirectory(prefix="cdpr-verify-")


def _run_line(run: Run, busy: int) -> str:
    how = "undisturbed"
    if run.number > 1:
        how = f"beside {busy} busy processes, stopped {run.stops} times for {run.held_s:.1f} s"
    return f"run {run.number}: {run.seconds:.1f} s, {how}"


def _check(run: Run) -> None:
    """Raise WorkFailedError where a run failed, with what it said."""
    if run.exit_status:
        lines = run.output.read_text(errors="replace").strip().splitlines() or ["(no output)"]
        raise WorkFailedError(
            f"run {run.number} ended with exit status {run.exit_status}: {lines[-1]}"
        )


def _new(folder: Path) -> Path:
    try:
        folder.mkdir(parents=True)
    except OSError as error:
        raise BadInputError(f"--keep {folder}: cannot be made: {error.strerror}") from error
    return folder.absolute()
