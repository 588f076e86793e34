"""Planned paths as files that the loop reads, and how far it has come on the last one.

A plan is written once by who plans, under a name that is a digest of what is in it. For the loop it
is read into memory and held against the robot's limits beside the cycles, when it is commanded. How
far it has come the loop writes into memory that outlives it, from where `keep_progress` has it on
the disk.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.shared_block import PATH
from cdpr_rt.motion.path.time_scaling import PERIOD_S, TimedPath
from cdpr_rt.private_files import FILE_MODE, make_private_folder
from cdpr_rt.programs.arguments import ProgramError
from cdpr_rt.programs.platform.paths.path_progress import read_progress
from cdpr_rt.programs.platform.paths.plan_check import first_fault
from cdpr_rt.robots.interface import RobotModel

MOST_BYTES: Final = 1 << 24
_MOST_WAITS: Final = 64
_NOTHING: Final = 1e-6
_HEAD_BYTES: Final = 4096
_KEPT: Final = 8
_KIND: Final = "cdpr-rt path 1"
_NAME: Final = re.compile(r"[0-9a-f]{32}")


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


def robot_key(model: RobotModel) -> str:
    """Return a text that another robot has not, nor this one with another file or other motors."""
    bounds = (model.low_N, model.high_N, model.torque_limited_N)
    key_text = repr((model.platform, *(bound.tolist() for bound in bounds)))
    return hashlib.sha256(key_text.encode()).hexdigest()[:32]


def write_plan(
    folder: Path, timed: TimedPath, lines: NDArray[np.int64], title: str, model: RobotModel
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
    plan = StoredPlan(name, title, PERIOD_S, samples, arrays[1], arrays[2], waits_s)
    return plan, head.get("robot")


class PathStore:
    """The plans of one robot in a folder, and how far it has come on the last one."""

    def __init__(self, model: RobotModel) -> None:
        self._model = model
        self.folder: Path | None = None
        self._ready: tuple[StoredPlan, ...] = ()
        self._progress = np.zeros(1, PATH)
        self._time = self._progress["time_s"]

    def open(
        self, folder: Path, progress: NDArray[Any] | None = None, *, simulated: bool = False
    ) -> None:
        """Take plans from a folder, and write how far they have come to `progress`, a `PATH` row.

        One that holds nothing yet is filled from the folder. Raises ProgramError where plans cannot
        be written there.
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
        """Read a plan and hold it against the robot's limits; for another thread than the loop's.

        Raises ProgramError for none, one for another robot, or one that does not keep the limits.
        """
        allowed = "allowed: the name that planning has given"
        if self.folder is None or _NAME.fullmatch(name) is None:
            raise ProgramError(f"path: plan: value {name[:40]!r}; {allowed}")
        path, model = self.folder / f"{name}.path", self._model
        try:
            with path.open("rb") as file:
                data = file.read(MOST_BYTES + 1)
            if len(data) > MOST_BYTES or not hashlib.sha256(data).hexdigest().startswith(name):
                raise ValueError
            plan, robot = _parsed_plan(name, data, model.size)
        except OSError:
            raise ProgramError(f"path: plan: value {name!r}: is not there; {allowed}") from None
        except (ValueError, KeyError, TypeError, ArithmeticError, RecursionError):
            raise ProgramError(f"{path}: is damaged: plan the path anew") from None
        if robot != robot_key(model):
            raise ProgramError(
                f"path: {plan.title} was planned for another robot, or its file has changed since; "
                "plan it anew"
            )
        bad = first_fault(model, plan.samples, plan.period_s)
        if bad >= 0:
            raise ProgramError(
                f"path: {plan.title}: breaks the robot's limits at line {int(plan.line[bad])}: "
                "plan it anew"
            )
        # the one before is kept, so that its memory is not given back in the loop's thread
        self._ready = (plan, *self._ready[:1])

    def is_loaded(self, name: str) -> bool:
        """Return whether a plan has been loaded."""
        return any(plan.name == name for plan in self._ready)

    def plan(self, name: str) -> StoredPlan:
        """Return a plan that has been loaded; raises ProgramError for another."""
        for plan in self._ready:
            if plan.name == name:
                return plan
        raise ProgramError(f"path: plan: value {name[:40]!r}: has not been loaded")

    # -- how far it has come

    @property
    def unfinished(self) -> tuple[str, float] | None:
        """Name of the plan that was not finished, and the time up to which it came; or None."""
        row = self._progress[0]
        name = bytes(row["name"]).decode("ascii", "replace")
        if row["over"] or not name or not np.isfinite(row["time_s"]):
            return None
        return name, float(row["time_s"])

    def mark_begun(self, name: str, time_s: float) -> None:
        """Write that a plan is followed from a time on."""
        self._progress["over"] = 1  # first: a kill in between leaves nothing that is wrong
        self._progress["name"], self._progress["time_s"] = name.encode(), time_s
        self._progress["over"] = 0

    def mark_progress(self, time_s: float) -> None:
        """Write up to which time it has come."""
        self._time[0] = time_s

    def mark_finished(self) -> None:
        """Write that nothing is left to be taken up again."""
        self._progress["over"] = 1
