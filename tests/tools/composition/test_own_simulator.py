"""A simulator of a command's own: what is done while it starts, and where it does not."""

from __future__ import annotations

import logging
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest
from typing_extensions import override

from cdpr_tools.compiling import announce_compiling
from cdpr_tools.composition.simulator import OwnSimulator
from cdpr_tools.errors import BadInputError
from tests.tools.robot_rig import unique


def test_work_is_done_while_it_starts_and_not_after() -> None:
    done: list[str] = []

    class Noted(OwnSimulator):
        @override
        def _await_ready(self) -> str:
            assert self.process.poll() is None
            done.append("waiting")
            return super()._await_ready()

    bus = f"simbus:{unique()}"
    Noted("winch-mpp0923d", bus, meanwhile=lambda: done.append("work")).stop()
    assert done == ["work", "waiting"]


def test_what_is_compiled_meanwhile_ends_where_it_fails(tmp_path: Path) -> None:
    plant = tmp_path / "bad.toml"
    plant.write_text("nonsense = 1\n")
    compiled: list[int] = []

    def work() -> None:
        for kernel in range(600):
            logging.getLogger("cdpr.compiling").info("a kernel")
            compiled.append(kernel)
            time.sleep(0.1)

    announce_compiling()
    bus = f"simbus:{unique()}"
    with pytest.raises(BadInputError, match="nonsense: unknown key"):
        OwnSimulator("winch-mpp0923d", bus, plant, meanwhile=work)
    assert 0 < len(compiled) < 600


def _command_lines() -> Iterator[str]:
    """Yield those of all processes."""
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        with suppress(OSError):  # it has ended meanwhile
            yield path.read_text()


@pytest.mark.long
@pytest.mark.alone  # how far one process has compiled when the other ends
@pytest.mark.parametrize("command", ["commission winch-mpp0923d", "run planar-3"])
def test_a_bad_plant_is_told_before_all_is_compiled(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: str
) -> None:
    plant, kept = tmp_path / "bad.toml", tmp_path / "kept"
    plant.write_text("nonsense = 1\n")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(kept))
    for name in ("XDG_RUNTIME_DIR", "XDG_STATE_HOME"):
        monkeypatch.setenv(name, str(tmp_path))
    line = [sys.executable, "-m", "cdpr_tools.cli", *command.split(), "--bus", "simbus:"]
    line += ["--plant", str(plant)]
    ended = subprocess.run(line, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert ended.returncode == 2 and "Traceback" not in ended.stderr
    assert ended.stderr.splitlines()[-1].startswith(f"cdpr: {plant}: nonsense: unknown key")
    assert len(list(kept.rglob("*.nbc"))) < 15  # of 17, and of 44
    assert not [line for line in _command_lines() if str(plant) in line]
