"""`cdpr doctor`: check whether this machine can run the controller, and how to fix it."""

from __future__ import annotations

import os
from dataclasses import asdict
from typing import Annotated

import typer

from cdpr_profiles.user_folders import temporary_folder
from cdpr_tools.commands.options import JsonOption, option
from cdpr_tools.errors import FAILED, WorkFailedError
from cdpr_tools.host.host_checks import look_around
from cdpr_tools.output import Output

app = typer.Typer()


@app.command()
def doctor(
    compile_all: Annotated[
        bool,
        option(
            "Only compile all numeric kernels. This takes minutes; later commands then start "
            "without compiling.",
            "--compile",
        ),
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Check this machine, and list what to fix before it runs a robot.

    Changes no setting. A `problem` must be fixed. A `note` would make the timing of cycles more
    regular.
    """
    out = Output(as_json)
    if compile_all:
        # imported here: it needs all packages that a robot needs
        from cdpr_tools.host.kernels import compile_kernels  # noqa: PLC0415

        if not compile_kernels(len(os.sched_getaffinity(0))):
            raise WorkFailedError(
                "--compile: compiled kernels cannot be kept: the program's folder, the user's "
                f"cache and {temporary_folder()} are not writable; set NUMBA_CACHE_DIR to a "
                "writable folder"
            )
        out.say("all kernels are compiled")
        out.result({"ok": True})
        return
    findings = list(look_around())
    for f in findings:
        out.say(f"{f.level:8}{f.what:22}{f.found}")
        if f.remedy:
            out.say(f"{'':8}{'':22}-> {f.remedy}")
    ok = all(f.level != "problem" for f in findings)
    out.result({"ok": ok, "findings": [asdict(f) for f in findings]})
    if not ok:
        raise typer.Exit(FAILED)
