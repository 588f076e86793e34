"""`cdpr doctor`: check whether this machine can run the controller, and how to fix it."""

from __future__ import annotations

import os
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from cdpr_profiles.user_folders import temporary_folder
from cdpr_tools.commands.options import JsonOption, option
from cdpr_tools.errors import FAILED, BadInputError, WorkFailedError, os_error_as
from cdpr_tools.host.host_checks import HostFinding, look_around
from cdpr_tools.output import Output
from cdpr_tools.saving import require_free

app = typer.Typer()


@app.command()
def doctor(
    report: Annotated[
        Path | None,
        option("Write everything that a fault report needs into this file; it contains no keys."),
    ] = None,
    robot: Annotated[
        list[str] | None,
        option("With --report: a robot's file to include; may be repeated.", "--robot"),
    ] = None,
    overwrite: Annotated[bool, option("Replace an existing --report file.", "--overwrite")] = False,
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
    regular. --report writes versions, findings, robot files and the end of the last recording to a
    file.
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
    if robot and report is None:
        raise BadInputError("--robot: only with --report")
    if report is not None:
        require_free("--report", report, overwrite)
        if not report.parent.is_dir():
            raise BadInputError(f"--report {report}: allowed: a file in an existing folder")
    findings = list(look_around())
    for f in findings:
        out.say(*lines_of(f))
    if report is not None:
        # imported here: reading recordings needs libraries that the checks do not
        from cdpr_tools.host.fault_report import fault_report  # noqa: PLC0415

        found = [line for f in findings for line in lines_of(f)]
        with os_error_as(BadInputError, f"--report {report}"):
            report.write_text(fault_report(found, robot or []), encoding="utf-8")
        out.say(f"report: {report}; look through it before you send it")
    ok = all(f.level != "problem" for f in findings)
    out.result({"ok": ok, "findings": [asdict(f) for f in findings], "report": report})
    if not ok:
        raise typer.Exit(FAILED)


def lines_of(finding: HostFinding) -> list[str]:
    """Return a finding as lines of text."""
    lines = [f"{finding.level:8}{finding.what:22}{finding.found}"]
    return lines + [f"{'':8}{'':22}-> {finding.remedy}"] * bool(finding.remedy)
