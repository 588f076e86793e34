"""`cdpr doctor`: what this machine can and cannot do for the controller, and how to mend it."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from cdpr_tools.commands.options import JsonOption
from cdpr_tools.errors import FAILED, BadInputError, os_error_as
from cdpr_tools.host.host_checks import HostFinding, look_around
from cdpr_tools.output import Output

app = typer.Typer()


@app.command()
def doctor(
    report: Annotated[
        Path | None,
        typer.Option(
            help="Write all that a report of a fault should have into this file; it holds no keys.",
        ),
    ] = None,
    robot: Annotated[
        list[str] | None,
        typer.Option("--robot", help="With --report: a robot's file to put in; may be repeated."),
    ] = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace the --report that is there already.")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Check this machine and tell what to fix before a robot runs on it.

    Changes nothing. A `problem` must be mended, a `note` makes cycles more punctual. With --report
    versions, findings, robot files and the end of the last recording go into a text file.
    """
    out = Output(as_json)
    if robot and report is None:
        raise BadInputError("--robot: only with --report")
    if report is not None and report.exists() and not overwrite:
        raise BadInputError(f"--report {report}: is there already; replace it with --overwrite")
    if report is not None and not report.parent.is_dir():
        raise BadInputError(f"--report {report}: allowed: a file in a folder that is there")
    findings = list(look_around())
    for f in findings:
        out.say(*lines_of(f))
    if report is not None:
        # loaded here: reading recordings takes libraries that the checks do without
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
    """Return a finding as lines for people."""
    lines = [f"{finding.level:8}{finding.what:22}{finding.found}"]
    return lines + [f"{'':8}{'':22}-> {finding.remedy}"] * bool(finding.remedy)
