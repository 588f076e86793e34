"""`cdpr doctor`: what this machine can and cannot do for the controller, and how to mend it."""

from __future__ import annotations

from dataclasses import asdict

import typer

from cdpr_tools.commands.options import JsonOption
from cdpr_tools.errors import FAILED
from cdpr_tools.host.host_checks import look_around
from cdpr_tools.output import Output

app = typer.Typer()


@app.command()
def doctor(as_json: JsonOption = False) -> None:
    """Look at this machine and say what to mend before a robot runs on it.

    Changes nothing. A `problem` must be mended, a `note` makes cycles more punctual.
    """
    out = Output(as_json)
    findings = list(look_around())
    for f in findings:
        out.say(f"{f.level:8}{f.what:22}{f.found}")
        if f.remedy:
            out.say(f"{'':8}{'':22}-> {f.remedy}")
    ok = all(f.level != "problem" for f in findings)
    out.result({"ok": ok, "findings": [asdict(f) for f in findings]})
    if not ok:
        raise typer.Exit(FAILED)
