"""The picture of a marker map: where markers and camera are, and how well each place is known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.patheffects import withStroke

from cdpr_rt.calibration.markers.map_fit import MapFit
from cdpr_tools.report.style import legend_beside_title, save_figure

_CAMERA, _REFERENCE = "#444444", "#d1581a"


def draw_map(fit: MapFit, path: Path) -> None:
    """Write the picture as PNG; raises OSError.

    Above the map from the front of its reference marker; below how well each place is known against
    its distance from there, along the reference marker's plane and across it, which is what figures
    3.20 and 3.21 of the thesis show of errors.
    """
    map_ = fit.map
    figure = Figure(figsize=(7.4, 8.6), layout=ConstrainedLayoutEngine(w_pad=0.15))
    top, low = figure.subplots(2, 1, height_ratios=(2.2, 1.0))
    placed = map_.placed
    sigma_mm = 1e3 * fit.bundle.marker_sigma_m
    corners = map_.corners_m()[placed][..., :2]
    shades = PolyCollection(list(corners), cmap="YlOrBr", edgecolors="#222222", linewidths=0.6)
    shades.set_array(np.linalg.norm(sigma_mm[placed], axis=1))
    top.add_collection(shades)
    for marker, position in zip(np.array(map_.ids)[placed], map_.position_m[placed], strict=True):
        colour = _REFERENCE if marker in fit.fixed else "#222222"
        name = top.annotate(
            str(marker), position[:2], ha="center", va="center", fontsize=7, color=colour
        )
        name.set_path_effects([withStroke(linewidth=2.0, foreground="white")])
    cameras = map_.camera_position_m[map_.located]
    top.plot(*cameras[:, :2].T, "+", ms=5, color=_CAMERA, label="camera")
    top.set(xlabel="x (m)", ylabel="y (m)", aspect="equal", title="marker map")
    top.autoscale_view()
    legend_beside_title(top)
    bar = figure.colorbar(shades, ax=top, shrink=0.8)
    bar.set_label("place known to (mm, 1 sigma)")
    bar.outline.set_visible(False)
    start = map_.ids.index(fit.fixed[0])
    away = np.linalg.norm(map_.position_m - map_.position_m[start], axis=1)
    turn = map_.rotation[start]
    start_of = 6 * len(map_.names)
    blocks = np.array(
        [
            fit.bundle.covariance[start_of + 6 * k : start_of + 6 * k + 3, start_of + 6 * k :][
                :, :3
            ]
            for k in range(len(map_.ids))
        ]
    )
    variance = np.einsum("ia,mij,ja->ma", turn, blocks, turn)[placed]
    along = 1e3 * np.sqrt(variance[:, :2].sum(axis=1))
    low.plot(away[placed], along, "o", ms=4, label="along the plane of the reference marker")
    low.plot(away[placed], 1e3 * np.sqrt(variance[:, 2]), "s", ms=4, label="across it")
    low.set(xlabel=f"distance from marker {fit.fixed[0]} (m)", ylabel="known to (mm, 1 sigma)")
    low.set_ylim(bottom=0.0)
    legend_beside_title(low)
    save_figure(figure, path)
