"""The report of a calibration: one self-contained HTML file with its pictures."""

from __future__ import annotations

import base64
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from matplotlib.ticker import MaxNLocator

from cdpr_rt.arrays import FloatArray, IntArray
from cdpr_rt.calibration.camera_model import SIZE, CameraModel
from cdpr_rt.calibration.fit import Fit
from cdpr_rt.calibration.marker_bundle import relative_std
from cdpr_rt.calibration.outcome import Outcome
from cdpr_rt.calibration.readings import CalibrationData
from cdpr_rt.calibration.residuals import length_std_m
from cdpr_rt.calibration.verification import parameter_table, predicted_std
from cdpr_tools import style
from cdpr_tools.calibrate.truth_comparison import PoseErrors, TruthComparison
from cdpr_tools.rendering import rendered
from cdpr_tools.saving import save

# The pictures of a calibration: changes found, residuals, and a map of the accuracy.

_COLOURS = 10
"""Largest number of cables that strong colours alone distinguish."""
_PLACED_m = 0.5
"""A marker whose position has a larger standard deviation counts as left out of the fit."""
_ARROW_m = 0.08
"""Length at which an error of typical size is drawn."""
_FINE, _COARSE = 15, 3
"""Grid points along each of the two drawn axes, and along the third one."""


def found_figure(outcome: Outcome) -> Figure:
    """Draw how far exit points moved, and the length residuals, with one colour per cable."""
    names = [axis.name for axis in outcome.robot.axes]
    colour_of = mpl.colormaps["tab10" if len(names) <= _COLOURS else "tab20"]
    found, geometry = outcome.found, outcome.found.geometry
    figure, (above, below) = style.canvas(2, height=2.7)
    n = geometry.n
    exits = [i for i, row in enumerate(geometry.rows) if row < 3]
    std = found.std[: n * len(geometry.rows)].reshape(n, -1)
    width = 0.8 / max(geometry.coordinates, 1)
    for place, column in enumerate(exits):
        at = np.arange(n) + (place - 0.5 * (len(exits) - 1)) * width
        above.bar(
            at, 1e3 * geometry.cable[:, place], width, yerr=3e3 * std[:, column], capsize=2,
            label="xyz"[place], color=(style.FORWARD, style.BACKWARD, style.COLOURS["none"])[place],
        )  # fmt: skip
    above.set(ylabel="exit point moved\n(mm, ± 3 sigma)", xlabel="cable")
    above.set_xticks(range(n), [f"{i + 1}\n{name}" for i, name in enumerate(names)])
    off_mm = 1e3 * found.length_residual_m * length_std_m(geometry, found.seen)
    poses = np.arange(1, found.seen.poses + 1)
    for i in range(n):
        used = found.seen.used[:, i]
        below.plot(poses[used], off_mm[used, i], "o", ms=2.5, color=colour_of(i), label=names[i])
    for fault in (one for one in outcome.faults if one.kind == "jump"):
        label = f"{names[fault.cable]} jumped by {1e3 * fault.size:+.1f} mm"
        below.axvline(fault.pose + 0.5, color=style.BACKWARD, lw=0.9, label=label)
    below.axhline(0.0, color="#777777", lw=0.8)
    below.set(xlabel="pose", ylabel="length residual (mm)", xlim=(0.5, poses[-1] + 0.5))
    below.xaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))
    style.legend_above(figure, above, below)
    return figure


def map_figure(outcome: Outcome, comparison: TruthComparison | None) -> Figure:
    """Draw how accurate positions are across the workspace, from above and from a side."""
    platform = outcome.found.geometry.model.platform
    views = [(0, 1)] if len(platform.home_m) == 2 else [(0, 1), (0, 2)]
    figure, axes = style.canvas(1, len(views), height=3.2)
    shades = [_shade(ax, outcome, view) for ax, view in zip(axes, views, strict=True)]
    high = max(float(np.asarray(shade.get_array()).max()) for shade in shades)
    for ax, shade, view in zip(axes, shades, views, strict=True):
        shade.set_clim(0.0, high)
        if comparison is not None:
            _held_out(ax, comparison.truth, comparison.places_m, view, labelled=ax is axes[-1])
        ax.margins(0.03)
        style.label_view(ax, view)
    bar = figure.colorbar(shades[0], ax=axes, shrink=0.8)
    bar.set_label("3 sigma, predicted (mm)")
    return figure


def _shade(ax: Axes, outcome: Outcome, view: tuple[int, int]) -> QuadMesh:
    """Draw the predicted position error: at each point the largest along the third axis."""
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
    """Draw true errors of held-out poses as arrows, with their scale if `labelled`."""
    i, j = view
    typical_m = float(np.median(np.linalg.norm(errors.position_m, axis=1))) or 1e-3
    size_m = float(f"{typical_m:.0e}")
    arrows = ax.quiver(
        places_m[:, i], places_m[:, j], errors.position_m[:, i], errors.position_m[:, j],
        color=style.COLOURS["harmonic"], angles="xy", scale_units="xy",
        scale=size_m / _ARROW_m, zorder=3, width=0.008,
    )  # fmt: skip
    tips = places_m + errors.position_m * (_ARROW_m / size_m)
    ax.update_datalim(tips[:, view])  # matplotlib does not count arrow tips as data
    ax.autoscale_view()
    if not labelled:
        return
    label = f"true error of a held-out pose: {1e3 * size_m:g} mm"
    ax.quiverkey(arrows, 0.1, 1.06, size_m, label, labelpos="E")


def held_out_figure(comparison: TruthComparison) -> Figure:
    """Draw errors of held-out poses against the scanner, before and after the calibration."""
    figure, axes = style.canvas(1, 2, height=2.6)
    after, before = comparison.scanner, comparison.scanner_before
    numbers = np.arange(len(after.position_m))
    for ax, key, scale, unit in (
        (axes[0], "position_m", 1e3, "mm"), (axes[1], "turn_rad", np.degrees(1.0), "deg"),
    ):  # fmt: skip
        for errors, label, colour, shift in (
            (before, "according to the robot's file", style.COLOURS["none"], -0.2),
            (after, "calibrated", style.COLOURS["harmonic"], 0.2),
        ):
            size = scale * np.linalg.norm(getattr(errors, key), axis=1)
            ax.bar(numbers + shift, size, 0.4, color=colour, label=label if ax is axes[0] else None)
        ax.set(xlabel="held-out pose", ylabel=f"error according to the scanner ({unit})")
        ax.set_xticks(numbers, [str(j + 1) for j in comparison.index], rotation=90)
    style.legend_above(figure, axes[0])
    return figure


def markers_figure(found: Fit) -> Figure:
    """Draw markers from above with their relative uncertainty, and the camera."""
    camera, poses = found.fitted_camera, found.poses
    placed, std_m = _known_to(found, camera)
    known_m = 3.0 * std_m
    figure, (ax,) = style.canvas(height=4.6)
    where, _ = camera.camera_poses(poses)
    ax.plot(where[:, 0], where[:, 1], "x", ms=4, color=style.COLOURS["none"], label="camera")
    largest_m = float(known_m.max(initial=1e-9))
    label: str | None = f"marker; circle: 3 sigma, the largest {1e3 * largest_m:.2f} mm"
    for k, sigma_m in zip(placed.tolist(), known_m.tolist(), strict=True):
        x, y = camera.marker_position_m[k, :2]
        radius = _ARROW_m * sigma_m / largest_m
        ax.add_patch(Circle((x, y), radius, fill=False, color=style.FORWARD))
        ax.plot([x], [y], "s", ms=5, color=style.FORWARD, label=label)
        label, marker = None, camera.ids[k]
        ax.annotate(str(marker), (x, y), xytext=(4, 4), textcoords="offset points", fontsize=7)
    ax.set(xlabel="x (m)", ylabel="y (m)", aspect="equal")
    style.legend_above(figure, ax)
    return figure


def _known_to(found: Fit, camera: CameraModel) -> tuple[IntArray, FloatArray]:
    """Return the markers with a known position, and their relative standard deviations in m."""
    first = found.geometry.size + found.jumps_m.size + camera.first_marker
    columns = first + 6 * np.arange(len(camera.ids))[:, None] + np.arange(3)
    placed = np.flatnonzero(np.sqrt(np.diag(found.uncertainty)[columns].max(axis=1)) < _PLACED_m)
    index = columns[placed].ravel()
    std_m = relative_std(camera.marker_position_m[placed], found.uncertainty[np.ix_(index, index)])
    return placed, std_m.max(axis=1)


_IMAGE_WIDTH_px = 900


def write_report(
    path: Path,
    outcome: Outcome,
    data: CalibrationData,
    comparison: TruthComparison | None,
    next_steps: list[str],
    images: Path,
) -> None:
    """Write the page; raises WorkFailedError if it cannot be written."""
    found, objections = outcome.found, outcome.objections()
    little = outcome.insignificance()
    pictures = {
        "map": map_figure(outcome, comparison),
        "found": found_figure(outcome),
        **({"held_out": held_out_figure(comparison)} if comparison is not None else {}),
        **({"markers": markers_figure(found)} if found.camera else {}),
    }
    text = rendered(
        "calibration.html.j2",
        title=f"Calibration of {outcome.robot.name}",
        outcome=outcome,
        data=data,
        comparison=comparison,
        verdict=objections or [outcome.accuracy(), outcome.frame(), *([little] if little else [])],
        faults=[one.text for one in outcome.faults if one.text not in objections],
        parameters=parameter_table(found),
        true_errors={row["name"]: row["error"] for row in comparison.parameters}
        if comparison is not None
        else {},
        camera=found.camera,
        camera_std=found.camera_std,
        size_std=float(found.camera_std[SIZE]) if found.camera else 0.0,
        cover=[] if outcome.cover is None else outcome.cover.lines(),
        image=_image(data, images) if found.camera else None,
        pictures={name: style.data_uri(figure) for name, figure in pictures.items()},
        next_steps=next_steps,
    )
    save(path, text)


def _image(data: CalibrationData, images: Path) -> dict[str, object] | None:
    """Return the image with the most markers, outlined, as source and pose; None without images."""
    # belongs to an extra that data without images do not need
    import cv2  # noqa: PLC0415

    from cdpr_drivers.camera.camera import CameraError  # noqa: PLC0415
    from cdpr_drivers.camera.folder_camera import decoded_image  # noqa: PLC0415

    shown = [len(one.image.markers) if one.image else 0 for one in data.poses]
    best = int(np.argmax(shown))
    reading = data.poses[best].image
    if reading is None:
        return None
    try:
        grey = decoded_image(images / f"pose-{best + 1:04d}.png")
    except CameraError:  # the file was deleted or changed
        return None
    pixels = cv2.cvtColor(grey, cv2.COLOR_GRAY2BGR)
    for marker in reading.markers:
        corners = np.rint(np.array(marker.corners_px)).astype(np.int32)
        cv2.polylines(pixels, [corners], True, (26, 88, 209), 3)
    scale = _IMAGE_WIDTH_px / pixels.shape[1]
    small = cv2.resize(pixels, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    _, coded = cv2.imencode(".jpg", small, [cv2.IMWRITE_JPEG_QUALITY, 80])
    source = "data:image/jpeg;base64," + base64.b64encode(coded.tobytes()).decode()
    return {"source": source, "pose": best + 1}
