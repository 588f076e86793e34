"""Run commands as a user types them, and check how they fail."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

from cdpr_here import cdpr_here

WINCH = "winch-mpp0923d"


OWN = ("--bus", "simbus:")


Result = subprocess.CompletedProcess[str]


def cdpr(*arguments: str | Path) -> Result:
    command = [sys.executable, "-m", "cdpr_tools.cli", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)


def done(*arguments: str | Path) -> dict[str, Any]:
    """Run a command with --json that must succeed. Return its last line."""
    result = cdpr(*arguments, "--json")
    assert result.returncode == 0, result.stderr
    told = json.loads(result.stdout.splitlines()[-1])
    assert told["ok"] is True
    return dict(told)


def refused(status: int, *arguments: str | Path, stdin: str = "") -> str:
    """Run a command that must fail. Return its one line of error."""
    result = cdpr_here(*arguments, stdin=stdin)
    assert result.returncode == status, result.stderr
    assert "Traceback" not in result.stderr
    lines = [line for line in result.stderr.splitlines() if "cdpr: " in line]
    assert len(lines) == 1, result.stderr
    assert result.stderr.rstrip().endswith(lines[0])
    return lines[0].partition("cdpr: ")[2]


def usage_error(*arguments: str) -> str:
    """Run a command with wrong arguments and return its error."""
    result = cdpr_here(*arguments)
    assert result.returncode == 2, result.stderr
    assert result.stdout == ""
    assert "Traceback" not in result.stderr
    return result.stderr
