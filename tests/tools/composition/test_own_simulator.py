"""A simulator that a command starts, and that fails to start."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest


def _command_lines() -> Iterator[str]:
    """Yield the command lines of all processes."""
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        with suppress(OSError):  # the process has ended meanwhile
            yield path.read_text()


@pytest.mark.parametrize("command", ["commission winch-mpp0923d", "run planar-3"])
def test_a_bad_plant_ends_the_command_and_its_simulator(tmp_path: Path, command: str) -> None:
    plant = tmp_path / "bad.toml"
    plant.write_text("nonsense = 1\n")
    env = os.environ | {"XDG_RUNTIME_DIR": str(tmp_path), "XDG_STATE_HOME": str(tmp_path)}
    line = [sys.executable, "-m", "cdpr_tools.cli", *command.split(), "--bus", "simbus:"]
    line += ["--plant", str(plant)]
    ended = subprocess.run(line, cwd=tmp_path, env=env, capture_output=True, text=True, check=False)
    assert ended.returncode == 2 and "Traceback" not in ended.stderr
    assert ended.stderr.splitlines()[-1].startswith(f"cdpr: {plant}: nonsense: unknown key")
    end_s = time.monotonic() + 10.0
    while left := [line for line in _command_lines() if str(plant) in line]:
        assert time.monotonic() < end_s, f"still run: {left}"
        time.sleep(0.05)
