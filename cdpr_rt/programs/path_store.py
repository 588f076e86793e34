"""Planned paths in files that the loop reads, and the progress along the last path.

The planner writes a plan once, in a file named by a digest of the content. When a command requests
the plan, another thread reads it into memory and checks it against the robot's limits. The loop
writes its progress into memory that outlives the loop, and `keep_progress` copies it to the disk.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from cdpr_profiles.bounded_input import open_regular, read_bytes, replacing
from cdpr_profiles.errors import FileMissingError, ProfileError
from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.shared_block import PATH
from cdpr_rt.jit import jit
from cdpr_rt.model.platform_model import PlatformModel
from cdpr_rt.motion.time_scaling import PERIOD_S, TimedPath, quintic
from cdpr_rt.programs.base import ProgramError
from cdpr_rt.state_file import FILE_MODE, make_private_folder, state_path

# Progress of a robot along its last path, on the disk: written by the service, not by the loop.

_EVERY_S: Final = 0.5
_LOOKS: Final = 3


def paths_folder(robot: str) -> Path:
    """Return the folder of a robot's plans, which also has the progress along the last one."""
    return state_path("paths", robot).with_suffix("")


def progress_file(folder: Path, *, simulated: bool = False) -> Path:
    """Return the file with the progress along the last path, real or simulated."""
    return folder / ("progress.simulated" if simulated else "progress")


def read_progress(folder: Path, *, simulated: bool = False) -> NDArray[Any]:
    """Return the `PATH` row in a folder of paths, or a row without a path."""
    try:
        with os.fdopen(open_regular(progress_file(folder, simulated=simulated)), "rb") as file:
            data = file.read(PATH.itemsize)
    except (ProfileError, OSError):
        data = b""
    whole = len(data) == PATH.itemsize
    return np.frombuffer(data, PATH).copy() if whole else np.zeros(1, PATH)


def write_progress(folder: Path, row: NDArray[Any], *, simulated: bool = False) -> None:
    """Write a `PATH` row, (1,), into a folder of paths; raises OSError."""
    make_private_folder(folder)
    # O_NONBLOCK: the file may have been replaced by a pipe that nobody reads
    flags = os.O_WRONLY | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW | os.O_NONBLOCK
    fd = os.open(progress_file(folder, simulated=simulated), flags, FILE_MODE)
    try:
        os.pwrite(fd, row.tobytes(), 0)
    finally:
        os.close(fd)


async def keep_progress(folder: Path, live: NDArray[Any], *, simulated: bool = False) -> None:
    """Keep a copy on the disk of a `PATH` row that the loop writes, until cancelled.

    While the disk is full, the old copy stays and the robot still follows the path.
    """
    # imported here because only the daemon, which loads asyncio anyway, keeps progress
    import asyncio  # noqa: PLC0415

    kept = b""
    try:
        while True:
            row = _settled(live)
            if row is not None and row["name"][0] and row.tobytes() != kept:
                written = await asyncio.to_thread(_try_to_write, folder, row, simulated)
                kept = row.tobytes() if written else kept
            await asyncio.sleep(_EVERY_S)
    finally:
        row = _settled(live)
        if row is not None and row["name"][0]:
            _try_to_write(folder, row, simulated)


def _settled(live: NDArray[Any]) -> NDArray[Any] | None:
    """Return a copy of a row, or None while the loop is writing another path into it."""
    for _ in range(_LOOKS):
        row = live.copy()
        if (row[["name", "over"]] == live[["name", "over"]]).all():
            return row
    return None


def _try_to_write(folder: Path, row: NDArray[Any], simulated: bool) -> bool:
    try:
        write_progress(folder, row, simulated=simulated)
    except OSError:
        return False
    return True


# Kernels of one cycle: play a planned path at any rate, forward and back, without leaving it.

TIME, RATE = 0, 1
"""Indices of the state: time along the plan, s, and the rate at which it passes."""
_QUICKEST_1_S: Final = 1e3
_LEAST_SHARE: Final = 0.25
_SETTLE_S: Final = 0.5
_THERE_S: Final = 1e-3
_STEP_m: Final = 1e-4
_MORE: Final = 1.002
_NOTHING: Final = 1e-12


@jit
def _between(
    samples: FloatArray, period: float, i: int, k: int, u: float
) -> tuple[float, float, float, float]:
    """Return a coordinate and its derivatives at a share u between two samples."""
    return quintic(
        samples[i, 0, k], samples[i, 1, k], samples[i, 2, k],
        samples[i + 1, 0, k], samples[i + 1, 1, k], samples[i + 1, 2, k], period, u,
    )  # fmt: skip


@jit
def _place(samples: FloatArray, period: float, time: float, out: FloatArray) -> None:
    """Write position and two derivatives (3, d) at a time of the plan."""
    i = min(max(int(time / period), 0), samples.shape[0] - 2)
    u = min(max(time / period - i, 0.0), 1.0)
    for k in range(samples.shape[2]):
        out[0, k], out[1, k], out[2, k], _ = _between(samples, period, i, k, u)


@jit
def play(
    samples: FloatArray,
    period: float,
    cycle: float,
    goal: float,
    wanted: float,
    acceleration: FloatArray,
    state: FloatArray,
    scratch: FloatArray,
    setpoint: FloatArray,
) -> bool:
    """Move one cycle along the plan towards the time `goal`; return whether it rests there.

    `wanted` is the rate, at least 0; if it is 0, the set-point comes to rest at any time of the
    plan. The rate changes with the part of `acceleration` (d,) that the path leaves, or with a
    quarter of `acceleration` if the path needs all of it. A goal later than the present time must
    be a rest of the plan. `setpoint` (3, d) is written.
    """
    time, rate = state[TIME], state[RATE]
    _place(samples, period, time, scratch)
    left = goal - time
    aim = wanted
    if left < 0.0:
        aim = -min(wanted, max(-left, _THERE_S) / _SETTLE_S)
    low, high, least = -_QUICKEST_1_S, _QUICKEST_1_S, _QUICKEST_1_S
    for k in range(acceleration.size):
        v, a = scratch[1, k], scratch[2, k] * rate * rate
        if abs(v) > _NOTHING:
            least = min(least, _LEAST_SHARE * acceleration[k] / abs(v))
            one, other = (-acceleration[k] - a) / v, (acceleration[k] - a) / v
            low, high = max(low, min(one, other)), min(high, max(one, other))
    low, high = min(low, -least), max(high, least)
    slope = min(max((aim - rate) / cycle, low), high)
    new = rate + slope * cycle
    time += 0.5 * (rate + new) * cycle
    if left >= 0.0 and time >= goal:
        time, new = goal, 0.0
    elif left < 0.0 and time <= goal + _THERE_S:
        time, new = max(time, goal), 0.0
    time = min(max(time, 0.0), period * (samples.shape[0] - 1))
    state[TIME], state[RATE] = time, new
    _place(samples, period, time, scratch)
    for k in range(acceleration.size):
        setpoint[0, k] = scratch[0, k]
        setpoint[1, k] = scratch[1, k] * new
        setpoint[2, k] = scratch[2, k] * new * new + scratch[1, k] * slope
    if new == 0.0:
        for k in range(acceleration.size):
            setpoint[1, k] = setpoint[2, k] = 0.0
    return bool(new == 0.0 and (wanted == 0.0 or abs(goal - time) <= _THERE_S))


@jit
def _keeps_between(
    samples: FloatArray,
    period: float,
    i: int,
    k: int,
    speed: float,
    acceleration: float,
    jerk: float,
) -> bool:
    """Return whether a coordinate stays within speed and acceleration limits between samples."""
    more = min(0.5 * period * jerk, acceleration)
    for j in range(1, 4):
        _, v, a, _ = _between(samples, period, i, k, 0.25 * j)
        if not abs(a) <= _MORE * acceleration + more:
            return False
        if not abs(v) <= _MORE * speed + 0.25 * period * acceleration:
            return False
    return True


@jit
def first_fault_of(
    samples: FloatArray,
    begin: int,
    end: int,
    period: float,
    speed: FloatArray,
    acceleration: FloatArray,
    jerk: FloatArray,
    low: FloatArray,
    high: FloatArray,
    angle: float,
) -> int:
    """Return the first sample from `begin` to `end` that is out of limits, or jumps; -1 for none.

    `low` and `high` (k,) bound the coordinates, `angle` the length of the rotation vector. Between
    samples the acceleration may exceed its limit by the jerk times half a period, but at most by a
    factor of 2.
    """
    last = samples.shape[0] - 1
    for i in range(begin, min(end, last + 1)):
        turned = 0.0
        for k in range(samples.shape[2]):
            q, v, a = samples[i, 0, k], samples[i, 1, k], samples[i, 2, k]
            # nan fails all of these comparisons
            if not (abs(v) <= _MORE * speed[k] and abs(a) <= _MORE * acceleration[k]):
                return i
            if k < low.size:
                if not (low[k] - _STEP_m <= q <= high[k] + _STEP_m):
                    return i
            else:
                turned += q * q
            if (i in (0, last)) and not (v == 0.0 and a == 0.0):
                return i
            if i < last:
                step = samples[i + 1, 0, k] - q - 0.5 * period * (v + samples[i + 1, 1, k])
                step += period * period * (samples[i + 1, 2, k] - a) / 12.0
                keeps = _keeps_between(samples, period, i, k, speed[k], acceleration[k], jerk[k])
                if not (abs(step) <= _STEP_m and keeps):
                    return i
        if not math.sqrt(turned) <= angle + _STEP_m:
            return i
    return -1


# Check of a plan's samples against the robot's limits and the cables, outside the loop's thread.

_AT_ONCE: Final = 100
"""Number of samples checked in one call; it is limited because the loop's thread cannot run during
a kernel."""
_HELD_EVERY: Final = 20
"""One in this number of samples is checked for feasible tensions."""
_HELD_AT_ONCE: Final = 10


def first_fault(model: PlatformModel, samples: FloatArray, period_s: float) -> int:
    """Return the first of the samples (c, 3, d) that breaks the robot's limits, -1 for none.

    It checks position, speed and acceleration at and between samples, then whether the cables hold
    the platform.
    """
    platform = model.platform
    low, high = np.array(platform.workspace_min_m), np.array(platform.workspace_max_m)
    limits = (model.speed, model.acceleration, model.jerk, low, high, model.angle_rad)
    for begin in range(0, len(samples), _AT_ONCE):
        bad = first_fault_of(samples, begin, begin + _AT_ONCE, period_s, *limits)
        if bad >= 0:
            return int(bad)
    held = model.workspace(0.0)
    chosen = samples[::_HELD_EVERY, 0]
    for begin in range(0, len(chosen), _HELD_AT_ONCE):
        poses = model.poses(chosen[begin : begin + _HELD_AT_ONCE])
        slack = held.capacity_margins(poses, 0.0) < 0.0
        if slack.any():
            return _HELD_EVERY * (begin + int(slack.argmax()))
    return -1


MOST_BYTES: Final = 1 << 24
_MOST_WAITS: Final = 64
_PATH_STORE_NOTHING: Final = 1e-6
_HEAD_BYTES: Final = 4096
_KEPT: Final = 8
_KIND: Final = "cdpr-rt path 1"
_NAME: Final = re.compile(r"[0-9a-f]{32}")


@dataclass(frozen=True)
class StoredPlan:
    """A planned path."""

    name: str
    title: str
    """Name of the path's file."""
    period_s: float
    samples: FloatArray
    """Position, velocity and acceleration at each sample, (c, 3, d)."""
    along_m: FloatArray
    """Distance along the path at each sample, (c,)."""
    line: NDArray[np.int64]
    """Lines of the path's file, (c,)."""
    waits_s: FloatArray
    """Times at which the path waits."""

    @property
    def duration_s(self) -> float:
        """Duration of the plan."""
        return self.period_s * (len(self.samples) - 1)

    def row(self, time_s: float) -> int:
        """Return the sample before a time."""
        return min(max(int(time_s / self.period_s + 1e-6), 0), len(self.samples) - 1)

    def row_along(self, along_m: float) -> int:
        """Return the first sample at least `along_m` along the path, or the last sample."""
        return min(int(np.searchsorted(self.along_m, along_m)), len(self.samples) - 1)


def robot_key(model: PlatformModel) -> str:
    """Return a text that identifies the robot, its file and its motors."""
    bounds = (model.low_N, model.high_N, model.torque_limited_N)
    key_text = repr((model.platform, *(bound.tolist() for bound in bounds)))
    return hashlib.sha256(key_text.encode()).hexdigest()[:32]


def write_plan(
    folder: Path, timed: TimedPath, lines: NDArray[np.int64], title: str, model: PlatformModel
) -> str:
    """Write a plan into a folder, which keeps the newest plans only; return the name of the plan.

    `lines` (c,) are the lines of the samples in the path's file. Raises ProgramError.
    """
    head: dict[str, Any] = {
        "kind": _KIND,
        "title": title[-200:],
        "robot": robot_key(model),
        "period_s": timed.period_s,
        "shape": list(timed.samples.shape),
        "waits_s": (timed.period_s * timed.waits[:_MOST_WAITS]).tolist(),
    }
    text = json.dumps(head).encode().ljust(_HEAD_BYTES, b" ")
    parts = (timed.samples.astype("<f8"), timed.along_m.astype("<f8"), lines.astype("<i8"))
    data = b"".join([text, *(part.tobytes() for part in parts)])
    if len(text) > _HEAD_BYTES or len(data) > MOST_BYTES or len(timed.waits) > _MOST_WAITS:
        most_s = MOST_BYTES / (len(data) / max(timed.duration_s, 1.0))
        raise ProgramError(
            f"{title}: takes {timed.duration_s / 60.0:.1f} min and waits {len(timed.waits)} times; "
            f"allowed: up to {most_s / 60.0:.1f} min, {_MOST_WAITS} times; divide the path"
        )
    name = hashlib.sha256(data).hexdigest()[:32]
    path = folder / f"{name}.path"
    try:
        make_private_folder(folder)
        with replacing(path, FILE_MODE) as file:
            file.write(data)
        left = [_left_on(folder, simulated=simulated) for simulated in (False, True)]
        plans = sorted(folder.glob("*.path"), key=lambda one: one.stat().st_mtime)
        for old in plans[:-_KEPT]:
            if old.stem not in left:
                old.unlink(missing_ok=True)
    except OSError as error:
        raise ProgramError(f"{path}: cannot be written: {error.strerror}") from error
    return name


def _left_on(folder: Path, *, simulated: bool) -> str:
    return bytes(read_progress(folder, simulated=simulated)["name"][0]).decode("ascii", "replace")


def _parsed_plan(name: str, data: bytes, d: int) -> tuple[StoredPlan, Any]:
    """Return the plan in a file, and the key of its robot; raises ValueError and others."""
    head = json.loads(data[:_HEAD_BYTES])
    count, three, size = head["shape"]
    sizes = (count * 3 * d, count, count)
    if (
        head["kind"] != _KIND
        or (three, size) != (3, d)
        or count < 2
        or head["period_s"] != PERIOD_S
        or len(data) != _HEAD_BYTES + 8 * sum(sizes)
    ):
        raise ValueError
    offset, arrays = _HEAD_BYTES, []
    for size, kind in zip(sizes, ("<f8", "<f8", "<i8"), strict=True):
        arrays.append(np.frombuffer(data, kind, size, offset))
        offset += 8 * size
    samples, waits_s = arrays[0].reshape(count, 3, d), np.array(head["waits_s"], float).ravel()
    row = np.round(waits_s / PERIOD_S)
    if (
        waits_s.size > _MOST_WAITS
        or not (
            (row >= 0) & (row < count) & (np.abs(row * PERIOD_S - waits_s) < _PATH_STORE_NOTHING)
        ).all()
        or (np.diff(row) <= 0).any()
        or samples[row.astype(np.int64), 1:].any()
    ):
        raise ValueError  # the path would wait while it moves
    title = str(head["title"])
    plan = StoredPlan(name, title, PERIOD_S, samples, arrays[1], arrays[2], waits_s)
    return plan, head.get("robot")


class PathStore:
    """The plans of one robot in a folder, and the progress along the last one."""

    def __init__(self, model: PlatformModel) -> None:
        self._model = model
        self.folder: Path | None = None
        self._ready: tuple[StoredPlan, ...] = ()
        self._progress = np.zeros(1, PATH)
        self._time = self._progress["time_s"]

    def open(
        self, folder: Path, progress: NDArray[Any] | None = None, *, simulated: bool = False
    ) -> None:
        """Use plans from a folder, and write progress to `progress`, a `PATH` row.

        An empty row is filled from the folder. Raises ProgramError if plans cannot be written
        there.
        """
        try:
            make_private_folder(folder)
        except OSError as error:
            raise ProgramError(f"{folder}: cannot be used: {error.strerror}") from error
        self.folder = folder
        if progress is not None:
            self._progress, self._time = progress, progress["time_s"]
        if not self._progress["name"][0]:
            self._progress[:] = read_progress(folder, simulated=simulated)

    def load(self, name: str) -> None:
        """Read a plan and check it against the robot's limits; must not run in the loop's thread.

        Raises ProgramError if the plan is missing, for another robot, or violates the limits.
        """
        allowed = "allowed: the name of a planned path"
        if self.folder is None or _NAME.fullmatch(name) is None:
            raise ProgramError(f"path: plan: value {name[:40]!r}; {allowed}")
        path, model = self.folder / f"{name}.path", self._model
        try:
            data = read_bytes(path, MOST_BYTES)
            if not hashlib.sha256(data).hexdigest().startswith(name):
                raise ValueError
            plan, robot = _parsed_plan(name, data, model.size)
        except FileMissingError:
            raise ProgramError(f"path: plan: value {name!r}: no such plan; {allowed}") from None
        except ProfileError as error:
            raise ProgramError(f"{error}: plan the path again") from None
        except (ValueError, KeyError, TypeError, ArithmeticError, RecursionError):
            raise ProgramError(f"{path}: is damaged: plan the path again") from None
        if robot != robot_key(model):
            raise ProgramError(
                f"path: {plan.title} was planned for another robot, or its file has changed since; "
                "plan it again"
            )
        bad = first_fault(model, plan.samples, plan.period_s)
        if bad >= 0:
            raise ProgramError(
                f"path: {plan.title}: breaks the robot's limits at line {int(plan.line[bad])}: "
                "plan it again"
            )
        # keep the previous plan, because its memory must not be freed in the loop's thread
        self._ready = (plan, *self._ready[:1])

    def is_loaded(self, name: str) -> bool:
        """Return whether a plan has been loaded."""
        return any(plan.name == name for plan in self._ready)

    def plan(self, name: str) -> StoredPlan:
        """Return a loaded plan; raises ProgramError if it has not been loaded."""
        for plan in self._ready:
            if plan.name == name:
                return plan
        raise ProgramError(f"path: plan: value {name[:40]!r}: has not been loaded")

    # -- progress along a plan

    @property
    def unfinished(self) -> tuple[str, float] | None:
        """Name of the unfinished plan and the time up to which it was followed; or None."""
        row = self._progress[0]
        name = bytes(row["name"]).decode("ascii", "replace")
        if row["over"] or not name or not np.isfinite(row["time_s"]):
            return None
        return name, float(row["time_s"])

    def mark_begun(self, name: str, time_s: float) -> None:
        """Record that the robot follows a plan from this time on."""
        self._progress["over"] = (
            1  # written first, so that the row is valid even if the process is killed in between
        )
        self._progress["name"], self._progress["time_s"] = name.encode(), time_s
        self._progress["over"] = 0

    def mark_progress(self, time_s: float) -> None:
        """Record the time up to which the plan was followed."""
        self._time[0] = time_s

    def mark_finished(self) -> None:
        """Record that there is no path to resume."""
        self._progress["over"] = 1
