"""The picture of a lens calibration: corners over the image, their residuals, and some images."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from cdpr_rt.calibration.marker_detection import IntrinsicsFit
from cdpr_tools.style import SERIES, save_figure

_SHOWN, _COLUMNS = 6, 3
_LARGER = 200.0
"""Factor by which residuals are drawn larger."""


def draw_lens(
    path: Path, fit: IntrinsicsFit, images: Sequence[tuple[str, NDArray[np.uint8]]]
) -> None:
    """Write the picture as PNG; raises OSError."""
    size = fit.intrinsics.width_px, fit.intrinsics.height_px
    figure = Figure(figsize=(9.0, 8.4), layout="constrained")
    halves: Any = figure.subfigures(2, 1, height_ratios=(1.25, 1.0))
    above, below = halves
    axes = above.subplots()
    corners, residuals = np.concatenate(fit.corners_px), np.concatenate(fit.residuals_px)
    arrows = axes.quiver(
        *corners.T, *(_LARGER * residuals).T, np.linalg.norm(residuals, axis=1),
        angles="xy", scale_units="xy", scale=1.0, width=0.0018, cmap="viridis",
    )  # fmt: skip
    axes.set(xlim=(0, size[0]), ylim=(size[1], 0), aspect="equal", xlabel="x (px)", ylabel="y (px)")
    axes.set_title(
        f"{len(corners)} corners in {len(fit.used)} images; residuals {_LARGER:.0f} times larger"
    )
    above.colorbar(arrows, ax=axes, label="residual (px)", shrink=0.8)
    pixels = dict(images)
    chosen = np.unique(np.linspace(0, len(fit.used) - 1, _SHOWN).round().astype(int))
    panels = below.subplots(_SHOWN // _COLUMNS, _COLUMNS).ravel()
    for panel in panels:
        panel.set_axis_off()
    for panel, number in zip(panels, chosen.tolist(), strict=False):
        name, rms = fit.used[number], np.sqrt(np.mean(fit.residuals_px[number] ** 2) * 2.0)
        panel.imshow(pixels[name], cmap="gray", vmin=0, vmax=255)
        panel.plot(*fit.corners_px[number].T, "+", ms=4, color=SERIES[1], lw=0.8)
        panel.set_title(f"{name}: {rms:.2f} px rms", fontsize=8.5)
    save_figure(figure, path)
