"""Modules of this project that run as processes of their own."""

from __future__ import annotations

import subprocess
import sys
from typing import Any


def module_command(module: str, *arguments: str) -> list[str]:
    """Return the command line that runs a module with this interpreter.

    Nothing of the working directory is imported in place of what is installed (-P).
    """
    return [sys.executable, "-P", "-m", module, *arguments]


def end_by_stdin(process: subprocess.Popen[Any], timeout_s: float) -> None:
    """Close the standard input of a process that ends by that; kill it where it does not in time.

    Its pipes are read to their end, and closed.
    """
    with process:
        try:
            process.communicate(timeout=timeout_s)
        except subprocess.TimeoutExpired:
            process.kill()
