"""`cdpr robot workspace`: compute where the cables can hold a robot's platform."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from cdpr_profiles import Robot
from cdpr_profiles.calibration_in_force import load_calibrated
from cdpr_profiles.platform import NO_PLATFORM, FURTHEST_m, Platform
from cdpr_rt.arrays import FloatArray
from cdpr_rt.model.rigid_body import directions_of
from cdpr_rt.model.statics import Box, view_of
from cdpr_rt.model.workspace_analysis import criterion_of, turns_within
from cdpr_tools.commands import options
from cdpr_tools.commands.options import option
from cdpr_tools.errors import BadInputError, os_error_as
from cdpr_tools.number_options import numbers, numbers_command
from cdpr_tools.output import Output
from cdpr_tools.robots.workspace_search import Found, Search, in_mm, search

app = typer.Typer()

_ANGLES = frozenset({"angle", "rx", "ry", "rz"})
_MESHES = (".stl", ".ply", ".obj")


@dataclass(frozen=True)
class _Typed:
    """The places and orientations from the command line, in mm and deg."""

    rotate: str | None
    within: float | None
    centre: str | None
    low: str | None
    high: str | None

    def turns(self, platform: Platform) -> FloatArray:
        """Return rotation vectors (k, 3) of the requested orientations."""
        if self.rotate is None and self.within is None:
            return np.zeros((1, 3))
        option = f"--rotate {self.rotate}" if self.within is None else f"--within {self.within:g}"
        if self.rotate is not None and self.within is not None:
            raise BadInputError(f"--rotate {self.rotate}: cannot be combined with --within")
        axes = [i - 3 for i in directions_of(platform) if i >= 3]
        if not axes:
            raise BadInputError(f"{option}: this platform has no controlled angle; omit the option")
        turn = np.zeros(3)
        if self.rotate is not None:
            names = [name for name in platform.controlled if name in _ANGLES]
            turn[axes] = numbers("--rotate", self.rotate, names, "deg", math.radians(1.0))
        angle = math.radians(self.within) if self.within is not None else np.linalg.norm(turn)
        if not 0.0 <= angle < math.pi:
            raise BadInputError(f"{option}: allowed: less than 180 deg from home's orientation")
        return turn[None] if self.within is None else turns_within(platform, float(angle))

    def box(self, platform: Platform) -> Box:
        """Return the box to search."""
        box = view_of(platform)
        low = self._position("--low", self.low, box.low_m)
        high = self._position("--high", self.high, box.high_m)
        if not (np.array(low) < high).all():
            raise BadInputError(
                f"--low {in_mm(low)} --high {in_mm(high)}: allowed: --low below --high in each "
                "coordinate"
            )
        return Box(tuple(low), tuple(high))

    def start(self, box: Box) -> FloatArray | None:
        """Return the place where rays start; None if the user gave none."""
        if self.centre is None:
            return None
        return np.array(self._position("--centre", self.centre, box.low_m))

    def _position(
        self, option: str, text: str | None, default: tuple[float, ...]
    ) -> tuple[float, ...]:
        if text is None:
            return default
        values = numbers(option, text, "xyz"[: len(default)], "mm", 1e-3)
        if max(map(abs, values)) > FURTHEST_m:
            raise BadInputError(f"{option} {text}: allowed: within {FURTHEST_m:g} m")
        return tuple(values)


@app.command(cls=numbers_command("--rotate", "--centre", "--low", "--high"))
def workspace(
    robot: options.RobotArgument,
    static: Annotated[
        bool,
        option("Workspace at rest, without the accelerations of the robot's file.", "--static"),
    ] = False,
    margin: Annotated[
        float, option("Margin that all tensions keep from their bounds, N.", min=0.0)
    ] = 0.0,
    rotate: Annotated[
        str | None,
        option(
            "Turn the platform by this rotation vector from its orientation at home, in deg; in a "
            "plane one angle.",
            metavar="RX RY RZ | ANGLE",
        ),
    ] = None,
    within: Annotated[
        float | None,
        option(
            "Find places that allow all orientations up to this many deg from home's.",
            metavar="DEG",
        ),
    ] = None,
    contact_free: Annotated[
        bool,
        option(
            "Exclude places where cables touch each other, the platform or obstacles.",
            "--contact-free",
        ),
    ] = False,
    low: Annotated[
        str | None, option("Lower corner of the search, in mm.", metavar="X Y [Z]")
    ] = None,
    high: Annotated[
        str | None,
        option("Upper corner of the search; by default around the whole robot.", metavar="X Y [Z]"),
    ] = None,
    centre: Annotated[
        str | None,
        option("Start of the rays, in mm; default: the middle of the targets.", metavar="X Y [Z]"),
    ] = None,
    rays: Annotated[int, option("Number of rays.", min=20, max=1_000_000)] = 5000,
    cells: Annotated[int, option("Cells of the grid along the longest side.", min=4, max=400)] = 60,
    png: options.PngOption = None,
    mesh: Annotated[
        Path | None,
        option(
            "Write the grid's surface, in m: .stl, .ply or .obj.",
            "--mesh",
            callback=options.written_as(*_MESHES),
        ),
    ] = None,
    workers: Annotated[
        int | None, option("Number of processes; default: one for each core.", min=1, max=256)
    ] = None,
    cluster: options.ClusterOption = None,
    as_json: options.JsonOption = False,
) -> None:
    """Compute where the cables can hold the platform.

    The exit status is 1 if they can hold it nowhere.
    """
    from cdpr_tools.robots.workspace_report import figures, lines  # noqa: PLC0415  # slow to load

    out = Output(as_json)
    profile = load_calibrated(robot)
    platform = profile.platform
    if platform is None:
        raise BadInputError(f"{profile.path}: {NO_PLATFORM}")
    typed = _Typed(rotate, within, centre, low, high)
    moving = 0.0 if static else platform.acceleration_m_s2
    criterion = criterion_of(profile, moving, typed.turns(platform), margin, contact_free)
    box = typed.box(platform)
    settings = Search(criterion, box, cells, rays, typed.start(box), workers, cluster)
    if mesh is not None and platform.is_planar:
        raise BadInputError(
            f"--mesh {mesh}: allowed only for robots in space; this robot is planar"
        )
    found = search(settings, out)
    results = figures(profile, settings, found)
    out.say(*lines(profile, settings, results))
    _write(profile, settings, found, png, mesh)
    out.say(*(f"{what:11}{path}" for what, path in (("picture", png), ("mesh", mesh)) if path))
    out.result({"ok": True, **results})


def _write(
    robot: Robot, settings: Search, found: Found, png: Path | None, mesh: Path | None
) -> None:
    if png is not None:
        from cdpr_tools.robots.workspace_report import draw_workspace  # noqa: PLC0415

        draw_workspace(robot, settings, found, png)
    if mesh is not None:
        import trimesh  # noqa: PLC0415  # slow to load

        with os_error_as(BadInputError, f"--mesh {mesh}"):
            trimesh.Trimesh(*found.grid.surface, process=False).export(mesh)  # in m
