"""`cdpr sim verify`: run a command several times and check that it writes the same files."""

from __future__ import annotations

import os
import random
import tempfile
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from cdpr_tools.commands.options import JsonOption, argument, option
from cdpr_tools.errors import BAD_INPUT, BadInputError, WorkFailedError, os_error_as
from cdpr_tools.output import Output
from cdpr_tools.repeat import Run, Stops, Verdict, compare, run_once
from cdpr_tools.signals import stop_on_signals

_SEEDS = 2**31


app = typer.Typer()


@app.command()
def verify(
    command: Annotated[
        list[str],
        argument(
            "After --: the arguments of `cdpr`, or the path of a program (with a /).",
            metavar="-- COMMAND...",
        ),
    ],
    runs: Annotated[int, option("Number of runs.", min=2, max=1000)] = 2,
    seed: Annotated[
        int | None, option("Random seed of the disturbances; default: random.", min=0)
    ] = None,
    busy: Annotated[
        int | None,
        option(
            "Number of busy processes that disturb it; default: one more than the number of cores.",
            min=0,
        ),
    ] = None,
    keep: Annotated[Path | None, option("New folder for all output.", metavar="DIR")] = None,
    as_json: JsonOption = False,
) -> None:
    """Run a command several times on simulated drives and compare all files.

    The first run is undisturbed. The others run beside busy processes, and their own processes are
    stopped, one after another, for 0.1 to 5 s. Each run has an empty working folder.
    """
    out = Output(as_json)
    chosen = random.randrange(_SEEDS) if seed is None else seed
    besides = (os.cpu_count() or 1) + 1 if busy is None else busy
    out.say(f"seed of the disturbances: {chosen}")
    with ExitStack() as stack:
        if keep is None:
            passing = tempfile.TemporaryDirectory(prefix="cdpr-verify-")
            folder = Path(stack.enter_context(passing))
        else:
            with os_error_as(BadInputError, f"--keep {keep}: cannot be created"):
                keep.mkdir(parents=True)
            folder = keep.absolute()
        stop_requested = stack.enter_context(stop_on_signals())
        done: list[Run] = []
        for number in range(1, runs + 1):
            stops = Stops(random.Random(f"{chosen} {number}")) if done else None
            beside = besides if done else 0
            done.append(run_once(command, folder, number, stops, beside, stop_requested))
            out.note(_run_line(done[-1], beside))
            _check(done[-1])
        verdicts = compare(done)
    same = _show(out, done, verdicts)
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
            "files": [asdict(verdict) for verdict in verdicts],
        }
    )
    if not same:
        raise typer.Exit(WorkFailedError.exit_status)


def _show(out: Output, runs: Sequence[Run], verdicts: Sequence[Verdict]) -> bool:
    """Print the verdicts; return whether all files are equal. Raises WorkFailedError if
    no file was written."""
    if not any(verdict.same is not None for verdict in verdicts):
        raise WorkFailedError("the command wrote no file that can be compared")
    for verdict in verdicts:
        out.say(verdict.line())
    same = all(verdict.same is not False for verdict in verdicts)
    out.say(f"{len(runs)} runs: {'the same' if same else 'NOT the same'}")
    return same


def _run_line(run: Run, busy: int) -> str:
    how = "undisturbed"
    if run.number > 1:
        how = f"beside {busy} busy processes, stopped {run.stops} times for {run.held_s:.1f} s"
    return f"run {run.number}: {run.seconds:.1f} s, {how}"


def _check(run: Run) -> None:
    """Raise an error with a failed run's message; BadInputError if the run did not begin."""
    if not run.exit_status:
        return
    said = _last_words(run.output.read_text(errors="replace"))
    problem = f"run {run.number} ended with exit status {run.exit_status}: {said}"
    raise BadInputError(problem) if run.exit_status == BAD_INPUT else WorkFailedError(problem)


def _last_words(output: str) -> str:
    """Return the last line of an output."""
    return (output.strip().splitlines() or ["(no output)"])[-1].removeprefix("cdpr: ")
