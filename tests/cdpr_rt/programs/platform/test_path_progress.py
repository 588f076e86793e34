"""What is written onto the disk of a path's progress while another path is begun."""

from __future__ import annotations

import asyncio
from pathlib import Path

import numpy as np
import pytest

from cdpr_rt.core.shared_block import PATH
from cdpr_rt.programs.platform.paths import path_progress
from cdpr_rt.programs.platform.paths.path_progress import keep_progress


class BeingBegun(np.ndarray):
    """A row in which another path is begun while it is looked at first."""

    looks = 0

    def copy(self, order: str = "C") -> np.ndarray:
        seen = np.array(self)
        self.looks += 1
        if self.looks == 1:
            self["name"], self["time_s"] = b"1" * 32, 0.0
        return seen


@pytest.mark.parametrize("ends", [False, True])
def test_what_is_begun_at_this_moment_is_looked_at_anew(
    monkeypatch: pytest.MonkeyPatch, ends: bool, tmp_path: Path
) -> None:
    written: list[bytes] = []

    def write(_folder: Path, row: np.ndarray, **_: bool) -> None:
        written.append(bytes(row["name"][0]))

    async def follow() -> None:
        live = np.zeros(1, PATH).view(BeingBegun)
        live.looks = 1
        keeping = asyncio.create_task(keep_progress(tmp_path, live))
        await asyncio.sleep(0)  # it has seen that there is none
        live["name"], live["time_s"], live.looks = b"0" * 32, 7.0, 0
        while not ends and not written:
            await asyncio.sleep(1e-3)
        keeping.cancel()
        await asyncio.gather(keeping, return_exceptions=True)

    monkeypatch.setattr(path_progress, "_EVERY_S", 1e-3)
    monkeypatch.setattr(path_progress, "write_progress", write)
    asyncio.run(follow())
    assert written and set(written) == {b"1" * 32}


def test_what_a_full_disk_refused_is_written_once_there_is_room(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    tried: list[str] = []

    def write(_folder: Path, _row: np.ndarray, **_: bool) -> None:
        tried.append("")
        if len(tried) < 3:
            raise OSError("no space left on device")

    async def follow() -> None:
        live = np.zeros(1, PATH)
        live["name"] = b"0" * 32
        keeping = asyncio.create_task(keep_progress(tmp_path, live))
        while len(tried) < 3:
            await asyncio.sleep(1e-3)
        await asyncio.sleep(0.02)
        assert len(tried) == 3  # what is written is not written again
        keeping.cancel()
        await asyncio.gather(keeping, return_exceptions=True)

    monkeypatch.setattr(path_progress, "_EVERY_S", 1e-3)
    monkeypatch.setattr(path_progress, "write_progress", write)
    asyncio.run(follow())
