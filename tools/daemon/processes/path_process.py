"""The process in which a daemon's paths are planned: `cdpr path`, nicer than the daemon."""

from __future__ import annotations

import asyncio
import sys
from pathlib import Path
from typing import Any, Final

_WITHIN_S: Final = 600.0
_NICER: Final = 10
_MOST_KiB: Final = 4 << 20
"""Of the process's memory: a file from outside does not take the daemon's."""
_WITHIN: Final = f'ulimit -v {_MOST_KiB} && exec nice -n{_NICER} "$@"'


async def plan_in_process(robot: str, file: Path, wanted: dict[str, Any]) -> tuple[int, str]:
    """Plan a file for a robot's profile; return exit status and the JSON line."""
    options = [f"--blend={wanted['blend_mm']}", f"--ignore={wanted['ignore']}"]
    if wanted["origin_mm"] is not None:
        options.append(f"--origin={wanted['origin_mm']}")
    command = [sys.executable, "-m", "cdpr_tools.cli", "path", str(file), "--robot", robot]
    process = await asyncio.create_subprocess_exec(
        "sh", "-c", _WITHIN, "sh", *command, "--keep", "--json", *options,
        stdin=asyncio.subprocess.DEVNULL, stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.DEVNULL,
    )  # fmt: skip
    try:
        output, _ = await asyncio.wait_for(process.communicate(), _WITHIN_S)
    except BaseException:
        process.kill()
        await process.wait()
        raise
    lines = output.decode("utf-8", "replace").strip().splitlines()
    return process.returncode or 0, lines[-1] if lines else ""
