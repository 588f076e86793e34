"""The pictures of a calibration: what was found, what is left, how good it is where."""

from __future__ import annotations

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from matplotlib.ticker import MaxNLocator

from cdpr_rt.arrays import FloatArray, IntArray
from cdpr_rt.calibration.camera.camera_model import CameraModel
from cdpr_rt.calibration.estimation.fit import Fit
from cdpr_rt.calibration.estimation.residuals import length_std_m
from cdpr_rt.calibration.outcome import Outcome
from cdpr_rt.calibration.verification.verdict import predicted_std
from cdpr_tools.calibrate.report.truth_comparison import PoseErrors, TruthComparison
from cdpr_tools.report.style import BACKWARD, COLOURS, FORWARD, canvas, legend_above

_COLOURS = 10
"""Of cables that are told apart by strong ones alone."""
_PLACED_m = 0.5
"""A marker of which the place is known no better was left out of the fit."""
_ARROW_m = 0.08
"""Length that an error of typical size is drawn with."""
_FINE, _COARSE = 15, 3
"""Places along each of the two axes that are drawn, and along the third one."""


def found_figure(outcome: Outcome) -> Figure:
    """Draw where exit points moved, and what the lengths still contradict, a colour a cable."""
    names = [axis.name for axis in outcome.robot.axes]
    colour_of = mpl.colormaps["tab10" if len(names) <= _COLOURS else "tab20"]
    found, geometry = outcome.found, outcome.found.geometry
    figure, (above, below) = canvas(2, height=2.7)
    n = geometry.n
    exits = [i for i, row in enumerate(geometry.rows) if row < 3]
    std = found.std[: n * len(geometry.rows)].reshape(n, -1)
    width = 0.8 / max(geometry.coordinates, 1)
    for place, column in enumerate(exits):
        at = np.arange(n) + (place - 0.5 * (len(exits) - 1)) * width
        above.bar(
            at, 1e3 * geometry.cable[:, place], width, yerr=2e3 * std[:, column], capsize=2,
            label="xyz"[place], color=(FORWARD, BACKWARD, COLOURS["none"])[place],
        )  # fmt: skip
    above.set(ylabel="exit point moved\n(mm, ± 2 sigma)", xlabel="cable")
    above.set_xticks(range(n), [f"{i + 1}\n{name}" for i, name in enumerate(names)])
    off_mm = 1e3 * found.length_residual_m * length_std_m(geometry, found.seen)
    poses = np.arange(1, found.seen.poses + 1)
    for i in range(n):
        used = found.seen.used[:, i]
        below.plot(poses[used], off_mm[used, i], "o", ms=2.5, color=colour_of(i), label=names[i])
    for fault in (one for one in outcome.faults if one.kind == "jump"):
        label = f"{names[fault.cable]} jumped by {1e3 * fault.size:+.1f} mm"
        below.axvline(fault.pose + 0.5, color=BACKWARD, lw=0.9, label=label)
    below.axhline(0.0, color="#777777", lw=0.8)
    below.set(xlabel="pose", ylabel="length left by the fit (mm)", xlim=(0.5, poses[-1] + 0.5))
    below.xaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))
    legend_above(figure, above, below)
    return figure


def map_figure(outcome: Outcome, comparison: TruthComparison | None) -> Figure:
    """Draw how well positions are known all over the workspace, from above and from a side."""
    platform = outcome.found.geometry.model.platform
    views = [(0, 1)] if len(platform.home_m) == 2 else [(0, 1), (0, 2)]
    figure, axes = canvas(1, len(views), height=3.2)
    shades = [_shade(ax, outcome, view) for ax, view in zip(axes, views, strict=True)]
    high = max(float(np.asarray(shade.get_array()).max()) for shade in shades)
    for ax, shade, view in zip(axes, shades, views, strict=True):
        shade.set_clim(0.0, high)
        if comparison is not None:
            _held_out(ax, comparison.truth, comparison.places_m, view, labelled=ax is axes[-1])
        ax.margins(0.03)
        ax.set(xlabel=f"{'xyz'[view[0]]} (m)", ylabel=f"{'xyz'[view[1]]} (m)", aspect="equal")
    bar = figure.colorbar(shades[0], ax=axes, shrink=0.8)
    bar.set_label("3 sigma, predicted (mm)")
    return figure


def _shade(ax: Axes, outcome: Outcome, view: tuple[int, int]) -> QuadMesh:
    """Draw the worst along the third axis of what positions are known to."""
    geometry = outcome.found.geometry
    platform, k = geometry.model.platform, geometry.coordinates
    axes = [
        np.linspace(low, high, _FINE if axis in view else _COARSE)
        for axis, (low, high) in enumerate(
            zip(platform.workspace_min_m, platform.workspace_max_m, strict=True)
        )
    ]
    grid = np.meshgrid(*axes, indexing="ij")
    places = np.stack(grid, axis=-1).reshape(-1, k)
    std = predicted_std(
        outcome.found, geometry.model.poses(places), relative=not outcome.known_room
    )
    sigma = 3e3 * np.linalg.norm(std[:, :k], axis=1).reshape(grid[0].shape) / np.sqrt(k)
    across = tuple(axis for axis in range(k) if axis not in view)
    worst = sigma.max(axis=across) if across else sigma
    x, y = np.meshgrid(axes[view[0]], axes[view[1]], indexing="ij")
    return ax.pcolormesh(x, y, worst, shading="gouraud", cmap="viridis_r")


def _held_out(
    ax: Axes, errors: PoseErrors, places_m: FloatArray, view: tuple[int, int], *, labelled: bool
) -> None:
    """Draw true errors of poses not used as arrows, and their scale where it is to be told."""
    i, j = view
    typical_m = float(np.median(np.linalg.norm(errors.position_m, axis=1))) or 1e-3
    size_m = float(f"{typical_m:.0e}")
    arrows = ax.quiver(
        places_m[:, i], places_m[:, j], errors.position_m[:, i], errors.position_m[:, j],
        color=COLOURS["better"], angles="xy", scale_units="xy", scale=size_m / _ARROW_m, zorder=3,
        width=0.008,
    )  # fmt: skip
    tips = places_m + errors.position_m * (_ARROW_m / size_m)
    ax.update_datalim(tips[:, view])  # axes leave room for what is longer than they know
    ax.autoscale_view()
    if not labelled:
        return
    label = f"true error of a pose not used: {1e3 * size_m:g} mm"
    ax.quiverkey(arrows, 0.1, 1.06, size_m, label, labelpos="E")


def held_out_figure(comparison: TruthComparison) -> Figure:
    """Draw errors of poses not used beside the scanner's, before and after."""
    figure, axes = canvas(1, 2, height=2.6)
    after, before = comparison.scanner, comparison.scanner_before
    numbers = np.arange(len(after.position_m))
    for ax, key, scale, unit in (
        (axes[0], "position_m", 1e3, "mm"), (axes[1], "turn_rad", np.degrees(1.0), "deg"),
    ):  # fmt: skip
        for errors, label, colour, shift in (
            (before, "by the robot's file", COLOURS["none"], -0.2),
            (after, "calibrated", COLOURS["better"], 0.2),
        ):
            size = scale * np.linalg.norm(getattr(errors, key), axis=1)
            ax.bar(numbers + shift, size, 0.4, color=colour, label=label if ax is axes[0] else None)
        ax.set(xlabel="pose not used", ylabel=f"off the scanner ({unit})")
        ax.set_xticks(numbers, [str(j + 1) for j in comparison.index], rotation=90)
    legend_above(figure, axes[0])
    return figure


def markers_figure(found: Fit) -> Figure:
    """Draw markers from above, how well they are known against each other, and the camera."""
    camera, poses = found.camera, found.poses
    assert camera is not None  # of a calibration with one
    placed, std_m = _known_to(found, camera)
    figure, (ax,) = canvas(height=4.6)
    where, _ = camera.camera_poses(poses)
    ax.plot(where[:, 0], where[:, 1], "x", ms=4, color=COLOURS["none"], label="camera")
    largest_m = float(std_m.max(initial=1e-9))
    label: str | None = f"marker; circle: 1 sigma, the largest {1e3 * largest_m:.2f} mm"
    for k, sigma_m in zip(placed.tolist(), std_m.tolist(), strict=True):
        x, y = camera.marker_position_m[k, :2]
        radius = _ARROW_m * sigma_m / largest_m
        ax.add_patch(Circle((x, y), radius, fill=False, color=FORWARD))
        ax.plot([x], [y], "s", ms=5, color=FORWARD, label=label)
        label, marker = None, camera.ids[k]
        ax.annotate(str(marker), (x, y), xytext=(4, 4), textcoords="offset points", fontsize=7)
    ax.set(xlabel="x (m)", ylabel="y (m)", aspect="equal")
    legend_above(figure, ax)
    return figure


def _known_to(found: Fit, camera: CameraModel) -> tuple[IntArray, FloatArray]:
    """Return which markers have a place, and how well these are known against each other, m.

    That is what is left of their covariance when all are moved to where they fit best.
    """
    first = found.geometry.size + found.jumps_m.size + camera.first_marker
    columns = first + 6 * np.arange(len(camera.ids))[:, None] + np.arange(3)
    placed = np.flatnonzero(np.sqrt(np.diag(found.uncertainty)[columns].max(axis=1)) < _PLACED_m)
    at, index = camera.marker_position_m[placed], columns[placed].ravel()
    motions = np.zeros((len(placed), 3, 6))
    motions[:, :, :3] = np.eye(3)
    for axis in range(3):
        motions[:, :, 3 + axis] = np.cross(np.eye(3)[axis], at - at.mean(axis=0))
    R = motions.reshape(-1, 6)
    free = np.eye(len(R)) - R @ np.linalg.pinv(R)
    variance = np.diag(free @ found.uncertainty[np.ix_(index, index)] @ free).reshape(-1, 3)
    return placed, np.sqrt(np.maximum(variance, 0.0)).max(axis=1)
