"""Program `path`: the set-point stays on the path under every command."""

from __future__ import annotations

import asyncio
import hashlib
import os
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import KDTree

from cdpr_rt.core.shared_block import PATH
from cdpr_rt.motion.path_description import Coordinates, Move, PathDescription
from cdpr_rt.motion.path_nodes import nodes_of
from cdpr_rt.motion.time_scaling import PathLimits, TimedPath, WrenchBounds, time_path
from cdpr_rt.programs import path_store
from cdpr_rt.programs.base import ProgramError
from cdpr_rt.programs.path import PathProgram
from cdpr_rt.programs.path_store import (
    PathStore,
    keep_progress,
    read_progress,
    write_plan,
    write_progress,
)
from tests.cdpr_rt.programs.ideal_platform import ROOM, IdealPlatform

OFF_m = 2e-6


def planned(platform: IdealPlatform) -> TimedPath:
    """Return a square with cut corners, a stop that waits, and a way back."""
    model = platform.model
    box = model.platform
    middle = np.zeros(model.size)
    middle[: model.positions] = 0.5 * np.add(box.workspace_min_m, box.workspace_max_m)
    coordinates = Coordinates(box.controlled, middle)
    path = PathDescription("square.nc", coordinates, middle, 1)
    for i, (x, y, turn, waits) in enumerate(
        [(0.1, 0.0, 0.0, False), (0.1, 0.08, 0.1, False), (0.0, 0.08, 0.0, True), (0, 0, 0, False)]
    ):
        there = middle.copy()
        there[0], there[1], there[-1] = middle[0] + x, middle[1] + y, turn
        path.add(Move(i + 2, there, np.inf, 0.03, waits=waits))
    nodes = nodes_of(path, model.wrench_scale)
    limits = PathLimits(model.speed, model.acceleration, model.jerk)
    return time_path(nodes, limits, WrenchBounds.none(len(nodes.s), model.size))


class PathRig:
    """A platform with a stored plan, and the program that follows it."""

    def __init__(self, platform: IdealPlatform, timed: TimedPath, folder: Path) -> None:
        self.platform, self.folder, self.timed = platform, folder, timed
        lines = np.arange(len(self.timed.samples))
        self.name = write_plan(folder, self.timed, lines, "square.nc", platform.model)
        self.live = np.zeros(1, PATH)
        self.store = platform.parts.paths = PathStore(platform.model)
        self.store.open(folder, self.live)
        platform.restart()
        self.program = PathProgram(platform.parts, np.full(platform.torque.size, 10.0))
        # all places between the plan's samples
        h, q = self.timed.period_s, self.timed.samples
        u = np.linspace(0.0, 1.0, 50, endpoint=False)[:, None, None]
        p, v, a = q[:-1, 0], h * q[:-1, 1], h * h * q[:-1, 2]
        w, b = h * q[1:, 1], h * h * q[1:, 2]
        gap, slope, bend = q[1:, 0] - p - v - 0.5 * a, w - v - a, b - a
        poly = (10 * gap - 4 * slope + 0.5 * bend, -15 * gap + 7 * slope - bend,
                6 * gap - 3 * slope + 0.5 * bend)  # fmt: skip
        every = p + u * (v + u * (0.5 * a + u * (poly[0] + u * (poly[1] + u * poly[2]))))
        self.places = KDTree(every.reshape(-1, q.shape[2]))

    def check_command(self, **wanted: object) -> None:
        self.platform.prepare(self.program, wanted)
        self.program.check(wanted)

    def begin_anew(self) -> None:
        """Start again as a new process, which has only the files."""
        write_progress(self.folder, self.live)
        self.store = self.platform.parts.paths = PathStore(self.platform.model)
        self.store.open(self.folder)
        self.program = PathProgram(self.platform.parts, np.full(self.platform.torque.size, 10.0))
        self.platform.restart()

    def begin(self, **wanted: object) -> None:
        self.platform.switch(self.program, wanted or {"plan": self.name})
        for _ in range(20_000):
            if self.stage == "path":
                break
            self.platform.cycle()
        self.platform.path.clear()
        self.platform.paces.clear()

    @property
    def stage(self) -> str:
        return str(self.program.progress()["path"]["stage"])

    @property
    def progress(self) -> dict[str, object]:
        return self.program.progress()["path"]

    def check(self, most: float = 1.25) -> None:
        """The set-point has been on the path and within the limits, apart from some braking."""
        places, paces = np.array(self.platform.path), np.array(self.platform.paces)
        step = np.linalg.norm(np.diff(self.places.data, axis=0), axis=1).max()
        assert self.places.query(places)[0].max() <= OFF_m + step
        model = self.platform.model
        assert (np.abs(paces) <= 1.001 * model.speed).all()
        slopes = np.abs(np.diff(paces, axis=0)) / 1e-3
        assert (slopes <= most * model.acceleration).all()


@pytest.fixture(scope="module")
def _platform() -> IdealPlatform:
    return IdealPlatform(ROOM, 10.0, 6000.0)


@pytest.fixture(scope="module")
def _timed(_platform: IdealPlatform) -> TimedPath:
    return planned(_platform)


@pytest.fixture
def rig(_platform: IdealPlatform, _timed: TimedPath, tmp_path: Path) -> Iterator[PathRig]:
    yield PathRig(_platform, _timed, tmp_path / "paths")


def test_a_path_is_followed_in_its_planned_time_and_waits_at_its_stop(rig):
    rig.begin()
    stop_s = rig.timed.period_s * rig.timed.waits[0]
    cycles = 0
    while not rig.progress["waiting"]:
        rig.platform.cycle()
        cycles += 1
    assert cycles == pytest.approx(1000 * stop_s, rel=0.01, abs=12)
    rig.platform.run(0.2)
    rig.program.command({"resume": True})
    rig.platform.until_rest()
    rig.check(1.01)
    np.testing.assert_allclose(rig.platform.control.position, rig.timed.samples[-1, 0], atol=1e-9)
    assert rig.platform.parts.paths.unfinished is None


def test_feed_pause_and_steps_back_never_leave_the_path(rig):
    rig.begin()
    chance = np.random.default_rng(2)
    print("seed 2")
    for k in range(14):
        wanted = [{"feed": float(chance.uniform(0.05, 1.0))}, {"pause": True}, {"resume": True},
                  {"back_m": float(chance.uniform(0.0, 0.1))}, {"resume": True}][k % 5]  # fmt: skip
        rig.program.command(wanted)
        rig.platform.run(float(chance.uniform(0.05, 0.4)))
    rig.check()


def test_a_hold_brakes_along_the_path_and_it_can_be_resumed(rig):
    rig.begin()
    rig.platform.run(0.6)
    rig.program.stop()
    rig.platform.until_rest()
    left = rig.progress["time_s"]
    assert 0.5 < left < 1.5
    rig.platform.switch(rig.program, {"resume": True})
    rig.platform.run(0.3)
    assert rig.progress["time_s"] > left
    rig.check()


def test_after_a_kill_the_path_resumes_where_it_was_left(rig):
    rig.begin()
    rig.platform.run(0.7)
    rig.program.command({"pause": True})
    rig.platform.run(0.5)
    left = rig.progress["time_s"]
    rig.begin_anew()
    assert rig.store.unfinished == (rig.name, pytest.approx(left))
    rig.begin(resume=True)
    assert rig.progress["time_s"] == pytest.approx(left)
    rig.platform.run(0.3)
    rig.check()


def test_invalid_path_commands_are_rejected(rig, tmp_path):
    rig.platform.restart()
    for wanted, told in (
        ({"plan": "../../etc/passwd"}, "plan: value"),
        ({"plan": "0" * 32}, "no such plan"),
        ({"resume": True}, "there is no path to continue"),
        ({"resume": 1}, "allowed: true"),
        ({"plan": rig.name, "feed": 2.0}, "feed: value 2.0; allowed"),
        ({"plan": rig.name, "resume": True}, "allowed: one of"),
        ({"quick": True}, "key 'quick'"),
    ):
        with pytest.raises(ProgramError, match=told):
            rig.check_command(**wanted)
    rig.platform.parts.not_calibrated_reason = "rail 2 was moved"
    with pytest.raises(ProgramError, match="path: rail 2 was moved"):
        rig.check_command(plan=rig.name)
    rig.platform.parts.not_calibrated_reason = ""
    file = rig.folder / f"{rig.name}.path"
    data = file.read_bytes()
    file.write_bytes(data.replace(b'"robot": "', b'"robot": "x', 1)[:4096] + data[4096:])
    rig.begin_anew()
    with pytest.raises(ProgramError, match="is damaged"):
        rig.check_command(plan=rig.name)
    file.write_bytes(data[:-8])
    with pytest.raises(ProgramError, match="is damaged"):
        rig.check_command(plan=rig.name)
    assert rig.store.unfinished is None


def test_a_plan_for_other_motors_is_rejected(rig, tmp_path):
    model = rig.platform.model
    weaker = replace(model, torque_limited_N=0.9 * model.high_N)
    lines = np.arange(len(rig.timed.samples))
    name = write_plan(rig.folder, rig.timed, lines, "square.nc", weaker)
    with pytest.raises(ProgramError, match="another robot, or its file has changed"):
        rig.store.load(name)


def swing(samples: np.ndarray, middle: slice) -> None:
    """Set alternating velocities at rest without acceleration."""
    samples[middle, 0] = samples[middle.start, 0]
    samples[middle, 1:] = 0.0
    samples[middle, 1, 0] = 0.15 * (-1.0) ** np.arange(middle.stop - middle.start)


SPOILT = {
    "position": lambda q, m: q[m, 0].__iadd__(0.01),
    "outside": lambda q, m: q[:, 0, 0].__iadd__(ROOM.workspace_max_m[0] - 0.01 - q[0, 0, 0]),
    "turned": lambda q, m: q[:, 0, 5].__iadd__(0.5),
    "speed": lambda q, m: q[m, 1].__iadd__(10.0),
    "acceleration": lambda q, m: q[m, 2].__iadd__(50.0),
    "nan": lambda q, m: q[m, 1].__imul__(np.nan),
    "begins": lambda q, m: q[0, 1].__iadd__(1e-3),
    "ends": lambda q, m: q[-1, 2].__iadd__(1e-3),
    "between": swing,
}


@pytest.mark.parametrize("what", SPOILT)
def test_a_plan_beyond_the_limits_is_rejected(rig, what):
    samples = rig.timed.samples.copy()
    half = len(samples) // 2
    while samples[half : half + 4, 1:].any(axis=(1, 2)).sum() < 4 or half in rig.timed.waits:
        half -= 1
    SPOILT[what](samples, slice(half, half + 4))
    spoilt = replace(rig.timed, samples=samples)
    lines = np.arange(len(samples))
    name = write_plan(rig.folder, spoilt, lines, "bad.nc", rig.platform.model)
    with pytest.raises(ProgramError, match="breaks the robot's limits at line"):
        rig.store.load(name)
    assert not rig.store.is_loaded(name)


def test_a_robot_in_need_of_calibration_follows_no_path(rig: PathRig) -> None:
    parts = rig.platform.parts
    rig.begin()
    parts.not_calibrated_reason = "rail 2 was moved"
    try:
        for wanted in ({"plan": rig.name}, {"resume": True}, {"back_m": 0.1}):
            with pytest.raises(ProgramError, match="path: rail 2 was moved"):
                rig.program.check(wanted)
    finally:
        parts.not_calibrated_reason = ""


def test_the_way_to_the_beginning_is_checked(rig: PathRig) -> None:
    """From the end of a path, and after another program has moved the platform."""
    rig.begin()
    rig.platform.run(0.3)
    ways = rig.platform.control.ways
    ways.clear()
    rig.check_command(resume=True)
    assert not ways
    rig.program.check({"plan": rig.name})
    assert len(ways) == 1
    rig.platform.switch(rig.platform.pose, {})
    rig.platform.cycle()
    rig.program.check({"resume": True})
    assert len(ways) == 2


def test_the_way_to_the_path_begins_where_a_moving_platform_stops(rig: PathRig) -> None:
    platform = rig.platform
    platform.restart()
    aim = platform.control.position.copy()
    aim[:2] += 0.2, 0.1
    platform.switch(platform.pose, {"position_m": aim[:3].tolist()})
    platform.run(0.3)
    platform.control.ways.clear()
    platform.switch(rig.program, {"plan": rig.name})
    ((here, _),) = platform.control.ways
    assert np.linalg.norm(here - platform.control.position) > 1e-3
    platform.run(0.3)
    assert min(np.linalg.norm(np.array(platform.path) - here, axis=1)) < 1e-9


def test_a_pause_on_the_way_to_the_path_stops_there(rig: PathRig) -> None:
    aside = rig.timed.samples[0, 0] - [0.1, 0, 0, 0, 0, 0]
    rig.platform.restart(aside)
    rig.platform.switch(rig.program, {"plan": rig.name})
    while rig.stage != "to the path":
        rig.platform.cycle()
    rig.platform.run(0.1)
    rig.program.command({"pause": True})
    rig.platform.run(0.5)
    here = rig.platform.control.position.copy()
    assert np.linalg.norm(here - rig.timed.samples[0, 0]) > 0.02
    rig.platform.run(0.3)
    np.testing.assert_array_equal(rig.platform.control.position, here)
    rig.begin(resume=True)
    rig.platform.run(0.2)
    assert rig.progress["time_s"] > 0.1


@pytest.mark.parametrize("time_s", [-1e7, 1e12, np.nan])
def test_an_invalid_stored_time_is_clipped_or_rejected(rig: PathRig, time_s: float) -> None:
    rig.begin()
    rig.live["time_s"] = time_s
    rig.begin_anew()
    if np.isnan(time_s):
        with pytest.raises(ProgramError, match="there is no path to continue"):
            rig.check_command(resume=True)
        return
    rig.begin(resume=True)
    assert rig.progress["time_s"] == (0.0 if time_s < 0.0 else rig.timed.duration_s)
    rig.platform.cycle()


@pytest.mark.parametrize(
    "spoilt",
    [b'"period_s": NaN', b'"period_s": 0', b'"waits_s": [0.5]', b'"waits_s": [NaN]',
     b'"waits_s": [-1.0]', b'"waits_s": [1e300]', b'"waits_s": [0.0, 0.0]'],
)  # fmt: skip
def test_a_plan_with_an_invalid_header_is_rejected(rig: PathRig, spoilt: bytes) -> None:
    file = rig.folder / f"{rig.name}.path"
    data = file.read_bytes()
    key = spoilt.split(b":")[0]
    head = re.sub(key + rb": (\[.*?\]|[^,}]*)", spoilt, data[:4096].rstrip())
    file.write_bytes(head.ljust(4096) + data[4096:])
    name = hashlib.sha256(file.read_bytes()).hexdigest()[:32]
    file.rename(rig.folder / f"{name}.path")
    with pytest.raises(ProgramError, match="is damaged"):
        rig.store.load(name)


def test_an_unfinished_plan_is_not_deleted(rig: PathRig) -> None:
    rig.begin()
    write_progress(rig.folder, rig.live)
    lines = np.arange(len(rig.timed.samples))
    for k in range(12):
        write_plan(rig.folder, rig.timed, lines, f"{k}.nc", rig.platform.model)
    kept = [path.stem for path in rig.folder.glob("*.path")]
    assert rig.name in kept
    assert len(kept) == 9


async def on_disk(folder: Path, wanted: np.ndarray) -> None:
    for _ in range(10_000):
        if read_progress(folder) == wanted:
            return
        await asyncio.sleep(1e-3)
    raise AssertionError(read_progress(folder))


def test_progress_is_written_to_the_disk_continuously(
    rig: PathRig, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def follow() -> None:
        keeping = asyncio.create_task(keep_progress(rig.folder, rig.live))
        await asyncio.sleep(0)
        for _ in range(2):
            rig.platform.run(0.1)
            await on_disk(rig.folder, rig.live)  # without the service's end
        rig.platform.run(0.1)
        assert read_progress(rig.folder) != rig.live
        keeping.cancel()  # as at the service's end
        await asyncio.gather(keeping, return_exceptions=True)

    monkeypatch.setattr(path_store, "_EVERY_S", 1e-3)
    rig.begin()
    assert not read_progress(rig.folder)["name"][0]
    asyncio.run(follow())
    assert read_progress(rig.folder) == rig.live


# Progress along the path on the disk.


class BeingBegun(np.ndarray):
    """A row in which another path begins during the first read."""

    looks = 0

    def copy(self, order: str = "C") -> np.ndarray:
        seen = np.array(self)
        self.looks += 1
        if self.looks == 1:
            self["name"], self["time_s"] = b"1" * 32, 0.0
        return seen


@pytest.mark.parametrize("ends", [False, True])
def test_progress_is_read_again_if_another_path_begins_meanwhile(
    monkeypatch: pytest.MonkeyPatch, ends: bool, tmp_path: Path
) -> None:
    written: list[bytes] = []

    def write(_folder: Path, row: np.ndarray, **_: bool) -> None:
        written.append(bytes(row["name"][0]))

    async def follow() -> None:
        live = np.zeros(1, PATH).view(BeingBegun)
        live.looks = 1
        keeping = asyncio.create_task(keep_progress(tmp_path, live))
        await asyncio.sleep(0)  # until it has seen that there is no path
        live["name"], live["time_s"], live.looks = b"0" * 32, 7.0, 0
        while not ends and not written:
            await asyncio.sleep(1e-3)
        keeping.cancel()
        await asyncio.gather(keeping, return_exceptions=True)

    monkeypatch.setattr(path_store, "_EVERY_S", 1e-3)
    monkeypatch.setattr(path_store, "write_progress", write)
    asyncio.run(follow())
    assert written and set(written) == {b"1" * 32}


def test_progress_is_written_when_a_full_disk_has_room_again(
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
        assert len(tried) == 3  # unchanged progress is not written again
        keeping.cancel()
        await asyncio.gather(keeping, return_exceptions=True)

    monkeypatch.setattr(path_store, "_EVERY_S", 1e-3)
    monkeypatch.setattr(path_store, "write_progress", write)
    asyncio.run(follow())


def test_a_pipe_in_place_of_the_progress_file_does_not_block(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "progress")
    assert not read_progress(tmp_path)["name"][0]
    with pytest.raises(OSError, match="No such device"):
        write_progress(tmp_path, np.zeros(1, PATH))
