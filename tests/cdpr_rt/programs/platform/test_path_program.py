"""Program `path`: the set-point stays on the path whatever is asked of it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import KDTree

from cdpr_rt.motion.path.description import Coordinates, Move, PathDescription
from cdpr_rt.motion.path.nodes import nodes_of
from cdpr_rt.motion.path.time_scaling import PathLimits, TimedPath, WrenchBounds, time_path
from cdpr_rt.programs.base import ProgramError
from cdpr_rt.programs.platform.path import PathProgram
from cdpr_rt.programs.platform.path_store import PathStore, write_plan
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


@pytest.fixture(scope="module")
def _platform() -> IdealPlatform:
    return IdealPlatform(ROOM, 10.0, 6000.0)


@pytest.fixture(scope="module")
def _timed(_platform: IdealPlatform) -> TimedPath:
    return planned(_platform)


class Rig:
    """A platform with a plan in its store, and the program that follows it."""

    def __init__(self, platform: IdealPlatform, timed: TimedPath, folder: Path) -> None:
        self.platform, self.folder, self.timed = platform, folder, timed
        lines = np.arange(len(self.timed.samples))
        self.name = write_plan(folder, self.timed, lines, "square.nc", platform.model)
        platform.parts.paths = PathStore()
        platform.parts.paths.open(folder)
        platform.restart()
        self.program = PathProgram(platform.parts, np.full(platform.torque.size, 10.0))
        # all places between samples, as the plan has them
        h, q = self.timed.period_s, self.timed.samples
        u = np.linspace(0.0, 1.0, 50, endpoint=False)[:, None, None]
        p, v, a = q[:-1, 0], h * q[:-1, 1], h * h * q[:-1, 2]
        w, b = h * q[1:, 1], h * h * q[1:, 2]
        gap, slope, bend = q[1:, 0] - p - v - 0.5 * a, w - v - a, b - a
        poly = (10 * gap - 4 * slope + 0.5 * bend, -15 * gap + 7 * slope - bend,
                6 * gap - 3 * slope + 0.5 * bend)  # fmt: skip
        every = p + u * (v + u * (0.5 * a + u * (poly[0] + u * (poly[1] + u * poly[2]))))
        self.places = KDTree(every.reshape(-1, q.shape[2]))

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
    def told(self) -> dict[str, object]:
        return self.program.progress()["path"]

    def check(self, most: float = 1.25) -> None:
        """The set-point has been on the path, and within the limits but for a part of braking."""
        places, paces = np.array(self.platform.path), np.array(self.platform.paces)
        step = np.linalg.norm(np.diff(self.places.data, axis=0), axis=1).max()
        assert self.places.query(places)[0].max() <= OFF_m + step
        model = self.platform.model
        assert (np.abs(paces) <= 1.001 * model.speed).all()
        slopes = np.abs(np.diff(paces, axis=0)) / 1e-3
        assert (slopes <= most * model.acceleration).all()


@pytest.fixture
def rig(_platform: IdealPlatform, _timed: TimedPath, tmp_path: Path) -> Iterator[Rig]:
    yield Rig(_platform, _timed, tmp_path / "paths")


def test_it_is_followed_in_the_planned_time_and_waits_where_it_is_to(rig):
    rig.begin()
    stop_s = rig.timed.period_s * rig.timed.waits[0]
    cycles = 0
    while not rig.told["waiting"]:
        rig.platform.cycle()
        cycles += 1
    assert cycles == pytest.approx(1000 * stop_s, rel=0.01, abs=12)
    rig.platform.run(0.2)
    rig.program.command({"resume": True})
    rig.platform.until_rest()
    rig.check(1.01)
    np.testing.assert_allclose(rig.platform.control.position, rig.timed.samples[-1, 0], atol=1e-9)
    assert rig.platform.parts.paths.left is None


def test_feed_pause_and_steps_back_never_leave_it(rig):
    rig.begin()
    chance = np.random.default_rng(2)
    print("seed 2")
    for k in range(14):
        wanted = [{"feed": float(chance.uniform(0.05, 1.0))}, {"pause": True}, {"resume": True},
                  {"back_m": float(chance.uniform(0.0, 0.1))}, {"resume": True}][k % 5]  # fmt: skip
        rig.program.command(wanted)
        rig.platform.run(float(chance.uniform(0.05, 0.4)))
    rig.check()


def test_a_hold_brakes_along_it_and_it_is_taken_up_again(rig):
    rig.begin()
    rig.platform.run(0.6)
    rig.program.stop()
    rig.platform.until_rest()
    left = rig.told["time_s"]
    assert 0.5 < left < 1.5
    rig.platform.switch(rig.program, {"resume": True})
    rig.platform.run(0.3)
    assert rig.told["time_s"] > left
    rig.check()


def test_after_a_kill_it_goes_back_to_where_it_was_left(rig):
    rig.begin()
    rig.platform.run(0.7)
    rig.program.command({"pause": True})
    rig.platform.run(0.5)
    left = rig.told["time_s"]
    # another process: nothing is left but the files, and the platform stands elsewhere
    rig.platform.parts.paths = PathStore()
    rig.platform.parts.paths.open(rig.folder)
    fresh = PathProgram(rig.platform.parts, np.full(rig.platform.torque.size, 10.0))
    assert rig.platform.parts.paths.left == (rig.name, pytest.approx(left))
    rig.platform.restart()
    rig.program = fresh
    rig.begin(resume=True)
    assert rig.told["time_s"] == pytest.approx(left)
    rig.platform.run(0.3)
    rig.check()


def test_what_is_refused(rig, tmp_path):
    rig.platform.restart()
    program, paths = rig.program, rig.platform.parts.paths
    for wanted, told in (
        ({"plan": "../../etc/passwd"}, "plan: value"),
        ({"plan": "0" * 32}, "is not there"),
        ({"resume": True}, "no path has been left"),
        ({"resume": 1}, "allowed: true"),
        ({"plan": rig.name, "feed": 2.0}, "feed: value 2.0; allowed"),
        ({"plan": rig.name, "resume": True}, "allowed: one of"),
        ({"quick": True}, "key 'quick'"),
    ):
        with pytest.raises(ProgramError, match=told):
            program.check(wanted)
    rig.platform.parts.distrust = "rail 2 was moved"
    with pytest.raises(ProgramError, match="path: rail 2 was moved"):
        program.check({"plan": rig.name})
    rig.platform.parts.distrust = ""
    file = rig.folder / f"{rig.name}.path"
    data = file.read_bytes()
    file.write_bytes(data.replace(b'"robot": "', b'"robot": "x', 1)[:4096] + data[4096:])
    with pytest.raises(ProgramError, match=r"is damaged|another robot"):
        program.check({"plan": rig.name})
    file.write_bytes(data[:-8])
    with pytest.raises(ProgramError, match="is damaged"):
        program.check({"plan": rig.name})
    assert paths.left is None


def swing(samples: np.ndarray, middle: slice) -> None:
    """Positions that agree with alternating velocities at no acceleration."""
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
def test_a_plan_beyond_the_limits_does_not_move(rig, what):
    samples = rig.timed.samples.copy()
    half = len(samples) // 2
    while samples[half : half + 4, 1:].any(axis=(1, 2)).sum() < 4 or half in rig.timed.waits:
        half -= 1
    SPOILT[what](samples, slice(half, half + 4))
    spoilt = TimedPath(
        rig.timed.period_s, samples, rig.timed.node, rig.timed.along_m, rig.timed.waits, 1
    )
    lines = np.arange(len(samples))
    name = write_plan(rig.folder, spoilt, lines, "bad.nc", rig.platform.model)
    rig.platform.restart()
    here = rig.platform.control.position.copy()
    rig.platform.switch(rig.program, {"plan": name})
    rig.platform.run(0.3)
    assert "breaks the robot's limits" in rig.program.progress()["trouble"]
    np.testing.assert_allclose(rig.platform.control.position, here, atol=1e-9)


def test_a_robot_whose_geometry_is_not_believed_follows_nothing(rig: Rig) -> None:
    parts = rig.platform.parts
    rig.begin()
    parts.distrust = "rail 2 was moved"
    try:
        for wanted in ({"plan": rig.name}, {"resume": True}, {"back_m": 0.1}):
            with pytest.raises(ProgramError, match="path: rail 2 was moved"):
                rig.program.check(wanted)
    finally:
        parts.distrust = ""


def test_the_way_back_to_the_beginning_is_looked_at(rig: Rig) -> None:
    """From the end of a path, and where something else has moved the platform in between."""
    rig.begin()
    rig.platform.run(0.3)
    ways = rig.platform.control.ways
    ways.clear()
    rig.program.check({"resume": True})
    assert not ways  # it is on the path
    rig.program.check({"plan": rig.name})
    assert len(ways) == 1
    rig.platform.switch(rig.platform.pose, {})
    rig.platform.cycle()
    rig.program.check({"resume": True})
    assert len(ways) == 2


def test_the_way_begins_where_a_moving_platform_stops(rig: Rig) -> None:
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
    while rig.stage == "checking":
        platform.cycle()
    platform.run(0.3)
    assert min(np.linalg.norm(np.array(platform.path) - here, axis=1)) < 1e-9


def test_a_pause_on_the_way_to_the_path_stops_there(rig: Rig) -> None:
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
    assert rig.told["time_s"] > 0.1


@pytest.mark.parametrize("time_s", [-1e7, 1e12, np.nan])
def test_a_spoilt_time_does_not_reach_the_plan(rig: Rig, time_s: float) -> None:
    rig.begin()
    file = rig.folder / "progress"
    told = np.fromfile(file, [("name", "S32"), ("time_s", "<f8"), ("over", "<i8")])
    told["time_s"] = time_s
    told.tofile(file)
    paths = rig.platform.parts.paths = PathStore()
    paths.open(rig.folder)
    rig.program = PathProgram(rig.platform.parts, np.full(rig.platform.torque.size, 10.0))
    rig.platform.restart()
    if np.isnan(time_s):
        with pytest.raises(ProgramError, match="no path has been left"):
            rig.program.check({"resume": True})
        return
    rig.begin(resume=True)
    assert rig.told["time_s"] == (0.0 if time_s < 0.0 else rig.timed.duration_s)
    rig.platform.cycle()


@pytest.mark.parametrize(
    "spoilt",
    [b'"period_s": NaN', b'"period_s": 0', b'"waits_s": [0.5]', b'"waits_s": [NaN]',
     b'"waits_s": [-1.0]', b'"waits_s": [1e300]', b'"waits_s": [0.0, 0.0]'],
)  # fmt: skip
def test_a_head_that_is_spoilt_is_refused(rig: Rig, spoilt: bytes) -> None:
    file = rig.folder / f"{rig.name}.path"
    data = file.read_bytes()
    key = spoilt.split(b":")[0]
    head = re.sub(key + rb": (\[.*?\]|[^,}]*)", spoilt, data[:4096].rstrip())
    file.write_bytes(head.ljust(4096) + data[4096:])
    with pytest.raises(ProgramError, match="is damaged"):
        rig.program.check({"plan": rig.name})


def test_a_file_that_is_not_what_was_planned_does_not_move(rig: Rig) -> None:
    file = rig.folder / f"{rig.name}.path"
    data = bytearray(file.read_bytes())
    data[-1] ^= 1  # a line's number
    file.write_bytes(data)
    rig.platform.restart()
    rig.platform.switch(rig.program, {"plan": rig.name})
    rig.platform.run(0.3)
    assert "is damaged" in rig.program.progress()["trouble"]


def test_the_plan_that_was_left_is_kept(rig: Rig) -> None:
    rig.begin()
    lines = np.arange(len(rig.timed.samples))
    for k in range(12):
        write_plan(rig.folder, rig.timed, lines, f"{k}.nc", rig.platform.model)
    kept = [path.stem for path in rig.folder.glob("*.path")]
    assert rig.name in kept
    assert len(kept) == 9


def test_a_second_of_the_path_is_lost_at_most_to_a_kill(rig: Rig) -> None:
    rig.begin()
    for _ in range(25):
        rig.platform.run(0.1)
        left = rig.platform.parts.paths.left
        assert left is not None
        assert 0.0 <= rig.told["time_s"] - left[1] <= 1.01
