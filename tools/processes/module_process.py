"""Modules of this project that run as processes of their own."""

from __future__ import annotations

import math
import subprocess
import sys
from contextlib import suppress
from typing import Any, Final

_LOOK_S: Final = 0.1


def module_command(module: str, *arguments: str) -> list[str]:
    """Return the command line that runs a module with this interpreter.

    Nothing of the working directory is imported in place of what is installed (-P).
    """
    return [sys.executable, "-P", "-m", module, *arguments]


def end_by_stdin(process: subprocess.Popen[Any], timeout_s: float) -> None:
    """Close the standard input of a process that ends by that; kill it where it does not in time.

    Nor does it outlive an interrupt. Its pipes are read while it runs, and closed; what it has
    started may keep them open.
    """
    with process:
        try:
            for _ in range(math.ceil(timeout_s / _LOOK_S)):
                with suppress(subprocess.TimeoutExpired):
                    process.communicate(timeout=_LOOK_S)
                if process.poll() is not None:
                    return
        finally:
            process.kill()
