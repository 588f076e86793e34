"""Planned paths as files that the loop reads, and how far it has come on the last one.

A plan is written once by who plans, under a name that is a digest of what is in it. The loop reads
it into memory when it is commanded, between two cycles: hence the bound of its size. How far it has
come lies in a mapped file, in which a number is written once a second of the path and when it comes
to rest: it outlives the loop's process, however that ends.
"""

from __future__ import annotations

import hashlib
import json
import mmap
import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from cdpr_rt.core.exchange import FloatArray
from cdpr_rt.motion.path.time_scaling import PERIOD_S, TimedPath
from cdpr_rt.private_files import FILE_MODE, make_private_folder
from cdpr_rt.programs.base import ProgramError
from cdpr_rt.robots.platform_model import PlatformModel
from cdpr_rt.state_file import state_path

MOST_BYTES: Final = 1 << 24
_MOST_WAITS: Final = 64
_NOTED_s: Final = 1.0
_NOTHING: Final = 1e-6
_HEAD_BYTES: Final = 4096
_KEPT: Final = 8
_KIND: Final = "cdpr-rt path 1"
_NAME: Final = re.compile(r"[0-9a-f]{32}")
_PROGRESS: Final = np.dtype(
    [("name", "S32"), ("time_s", "<f8"), ("over", "<i8")]
)  # how far, and whether there is nothing left to take up


@dataclass(frozen=True)
class StoredPlan:
    """A planned path."""

    name: str
    title: str
    """The path's file."""
    period_s: float
    samples: FloatArray
    """(c, 3, d)"""
    along_m: FloatArray
    """(c,)"""
    line: NDArray[np.int64]
    """Of the path's file, (c,)."""
    waits_s: FloatArray
    """Times at which it waits."""
    data: bytes
    """The file, of which `name` is the digest."""

    @property
    def duration_s(self) -> float:
        """How long it takes."""
        return self.period_s * (len(self.samples) - 1)

    def row(self, time_s: float) -> int:
        """Return the sample before a time."""
        return min(max(int(time_s / self.period_s + 1e-6), 0), len(self.samples) - 1)

    def row_along(self, along_m: float) -> int:
        """Return the first sample as far along the path, or the last one."""
        return min(int(np.searchsorted(self.along_m, along_m)), len(self.samples) - 1)


def paths_folder(robot: str) -> Path:
    """Return where the plans for a robot's profile lie, and how far the last one has come."""
    return state_path("paths", robot).with_suffix("")


def robot_key(model: PlatformModel) -> str:
    """Return a text that another robot, or this one with another file, has not."""
    told = repr((model.platform, model.low_N.tolist(), model.high_N.tolist()))
    return hashlib.sha256(told.encode()).hexdigest()[:32]


def write_plan(
    folder: Path, timed: TimedPath, lines: NDArray[np.int64], title: str, model: PlatformModel
) -> str:
    """Write a plan into a folder, where the newest few stay; return its name.

    `lines` (c,) are those of the samples in the path's file. Raises ProgramError.
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
    fresh = path.with_suffix(f".{os.getpid()}.new")
    try:
        make_private_folder(folder)
        fd = os.open(fresh, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_CLOEXEC, FILE_MODE)
        with os.fdopen(fd, "wb") as file:
            file.write(data)
        fresh.replace(path)
        left = _left_in(folder)
        plans = sorted(folder.glob("*.path"), key=lambda one: one.stat().st_mtime)
        for old in plans[:-_KEPT]:
            if old.stem != left:
                old.unlink(missing_ok=True)
    except OSError as error:
        raise ProgramError(f"{path}: cannot be written: {error.strerror}") from error
    return name


def _plan_in(name: str, data: bytes, d: int) -> tuple[StoredPlan, Any]:
    """Return the plan that a file holds, and for which robot; raises ValueError and others."""
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
        or not ((row >= 0) & (row < count) & (np.abs(row * PERIOD_S - waits_s) < _NOTHING)).all()
        or (np.diff(row) <= 0).any()
        or samples[row.astype(np.int64), 1:].any()
    ):
        raise ValueError  # it would wait where it does not rest
    title = str(head["title"])
    plan = StoredPlan(name, title, PERIOD_S, samples, arrays[1], arrays[2], waits_s, data)
    return plan, head.get("robot")


def _left_in(folder: Path) -> str:
    """Return the name of the plan that was not finished, an empty text for none."""
    file = folder / "progress"
    if not file.exists():
        return ""
    rows = np.fromfile(file, _PROGRESS, 1)
    return bytes(rows[0]["name"]).decode("ascii", "replace") if rows.size else ""


class PathStore:
    """The plans of one robot in a folder, and how far it has come; in memory without a folder."""

    def __init__(self) -> None:
        self.folder: Path | None = None
        self._progress = np.zeros(1, _PROGRESS)
        self._progress["over"] = 1
        self._noted_s = 0.0
        self._read: tuple[tuple[int, ...], StoredPlan] | None = None
        """The last plan, by what tells its file from others."""

    def open(self, folder: Path) -> None:
        """Take plans and progress from a folder; raises ProgramError where it cannot be written."""
        file = folder / "progress"
        try:
            make_private_folder(folder)
            fd = os.open(file, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, FILE_MODE)
            try:
                fresh = os.fstat(fd).st_size != _PROGRESS.itemsize
                os.ftruncate(fd, _PROGRESS.itemsize)
                os.posix_fallocate(fd, 0, _PROGRESS.itemsize)  # no fault later on a full disk
                mapped = mmap.mmap(fd, _PROGRESS.itemsize)
            finally:
                os.close(fd)
        except OSError as error:
            raise ProgramError(f"{file}: cannot be used: {error.strerror}") from error
        self.folder = folder
        self._progress = np.frombuffer(mapped, _PROGRESS, 1)
        if fresh:
            self._progress["over"] = 1

    def plan(self, name: str, model: PlatformModel) -> StoredPlan:
        """Return a plan by its name; raises ProgramError for none, or one for another robot."""
        allowed = "allowed: the name that planning has given"
        if self.folder is None or _NAME.fullmatch(name) is None:
            raise ProgramError(f"path: plan: value {name[:40]!r}; {allowed}")
        path = self.folder / f"{name}.path"
        try:
            with path.open("rb") as file:
                state = os.fstat(file.fileno())
                key = (state.st_ino, state.st_size, state.st_mtime_ns, state.st_ctime_ns)
                if self._read is not None and (key, name) == (self._read[0], self._read[1].name):
                    return self._read[1]
                if state.st_size > MOST_BYTES:
                    raise ValueError
                data = file.read(MOST_BYTES)
            plan, robot = _plan_in(name, data, model.size)
        except OSError:
            raise ProgramError(f"path: plan: value {name!r}: is not there; {allowed}") from None
        except (ValueError, KeyError, TypeError, ArithmeticError, RecursionError):
            raise ProgramError(f"{path}: is damaged: plan the path anew") from None
        if robot != robot_key(model):
            raise ProgramError(
                f"path: {plan.title} was planned for another robot, or its file has changed since; "
                "plan it anew"
            )
        self._read = key, plan
        return plan

    # -- how far it has come

    @property
    def left(self) -> tuple[str, float] | None:
        """Name of the plan that was not finished, and the time up to which it came; or None."""
        row = self._progress[0]
        name = bytes(row["name"]).decode("ascii", "replace")
        if row["over"] or not name or not np.isfinite(row["time_s"]):
            return None
        return name, float(row["time_s"])

    def begin(self, name: str, time_s: float) -> None:
        """Have a plan been begun."""
        self._progress["over"] = 1  # first: a kill in between leaves nothing that is wrong
        self._progress["name"], self._progress["time_s"] = name.encode(), time_s
        self._progress["over"] = 0
        self._noted_s = time_s

    def note(self, time_s: float, at_rest: bool) -> None:
        """Have come so far; the file has it once a second of the path, and at rest."""
        if abs(time_s - self._noted_s) >= (_NOTHING if at_rest else _NOTED_s):
            self._progress["time_s"] = self._noted_s = time_s

    def end(self) -> None:
        """Have finished."""
        self._progress["over"] = 1
