"""A platform with a plan in its store, and the program that follows it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.spatial import KDTree

from cdpr_rt.core.shared_block import PATH
from cdpr_rt.motion.path.description import Coordinates, Move, PathDescription
from cdpr_rt.motion.path.nodes import nodes_of
from cdpr_rt.motion.path.time_scaling import PathLimits, TimedPath, time_path
from cdpr_rt.motion.path.time_scaling_kernel import WrenchBounds
from cdpr_rt.programs.platform.paths.path import PathProgram
from cdpr_rt.programs.platform.paths.path_progress import (
    write_progress,
)
from cdpr_rt.programs.platform.paths.path_store import PathStore, write_plan
from tests.cdpr_rt.programs.ideal_platform import IdealPlatform

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
    """A platform with a plan in its store, and the program that follows it."""

    def __init__(self, platform: IdealPlatform, timed: TimedPath, folder: Path) -> None:
        self.platform, self.folder, self.timed = platform, folder, timed
        lines = np.arange(len(self.timed.samples))
        self.name = write_plan(folder, self.timed, lines, "square.nc", platform.model)
        self.live = np.zeros(1, PATH)
        self.store = platform.parts.paths = PathStore(platform.model)
        self.store.open(folder, self.live)
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

    def check_command(self, **wanted: object) -> None:
        self.platform.prepare(self.program, wanted)
        self.program.check(wanted)

    def begin_anew(self) -> None:
        """As another process does: nothing is left but the files."""
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
        """The set-point has been on the path, and within the limits but for a part of braking."""
        places, paces = np.array(self.platform.path), np.array(self.platform.paces)
        step = np.linalg.norm(np.diff(self.places.data, axis=0), axis=1).max()
        assert self.places.query(places)[0].max() <= OFF_m + step
        model = self.platform.model
        assert (np.abs(paces) <= 1.001 * model.speed).all()
        slopes = np.abs(np.diff(paces, axis=0)) / 1e-3
        assert (slopes <= most * model.acceleration).all()
