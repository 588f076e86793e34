"""The picture of a robot: exit points, cables, platform, and its workspace."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from matplotlib.ticker import MaxNLocator

from cdpr_profiles import Robot
from cdpr_profiles.platform import Platform
from cdpr_rt.arrays import FloatArray
from cdpr_rt.model.statics import Box, PlatformStatics, statics_of, view_of
from cdpr_tools import style

_PLATFORM = "#d1581a"
_WIDE_in = 7.4
_LEAST_HIGH = 0.32
"""Smallest ratio of a view's height to its width; the colour bar's label needs this room."""
_SEEN_THROUGH = 0.6
"""Opacity of the platform, which may cover the whole box of targets."""
_SEEN_FROM = "from the side", "from the front", "from above"
"""The viewpoint along each axis."""
_OUTLINE = 721
"""Number of directions for the platform's outline, the furthest anchor point in each of them."""

# shares of the exit points' extent: names of points closer than this would touch
_CLOSE = 0.1
# and names of points closer than this in x and y would cover each other
_TOGETHER = 0.02, 0.06

_LOOKS, _PAD = 4, 3.0
_FINE, _COARSE = (121, 95), (41, 31)

_View = tuple[int, int]
"""Coordinates that a view shows to the right and upward."""


def draw_robot(robot: Robot, platform: Platform, path: Path) -> None:
    """Write the picture of a robot as PNG."""
    style.save_figure(figure_of(robot, platform), path, tight=True)


def figure_of(robot: Robot, platform: Platform) -> Figure:
    """Return the picture of a robot.

    A robot in space is seen from the front, from the side and from above. The workspace is cut
    through the middle of the box of targets. Its colour shows how far tensions can stay from their
    bounds in home's orientation; a dotted line encloses targets accepted in all orientations.
    """
    shown, statics = view_of(platform), statics_of(robot)
    size = np.subtract(shown.high_m, shown.low_m)
    views = [(0, 1)] if platform.is_planar else [(0, 2), (1, 2), (0, 1)]
    heights = [max(_LEAST_HIGH, float(size[j] / size[:2].max())) for _, j in views]
    figure = Figure(figsize=(_WIDE_in, _WIDE_in * sum(heights) * 0.9), layout="constrained")
    all_axes = list(figure.subplots(len(views), squeeze=False, height_ratios=heights)[:, 0])
    _draw_workspace(figure, all_axes, [_Section.of(statics, shown, view) for view in views])
    for ax, view in zip(all_axes, views, strict=True):
        _draw_machine(ax, robot, platform, view)
        i, j = view
        style.label_view(ax, view)
        ax.set(xlim=(shown.low_m[i], shown.high_m[i]), ylim=(shown.low_m[j], shown.high_m[j]))
        ax.grid(visible=False)
        if not platform.is_planar:
            ax.set_title(_title(platform, view), fontsize="medium")
    figure.suptitle(robot.name)
    style.legend_below(figure, all_axes[0], columns=3)
    for _ in range(_LOOKS):
        if _has_room(figure, all_axes[-1]):
            break
    return figure


def _title(platform: Platform, view: _View) -> str:
    (k,) = {0, 1, 2} - set(view)
    middle_m = 0.5 * (platform.workspace_min_m[k] + platform.workspace_max_m[k])
    return f"{_SEEN_FROM[k]}; workspace at {'xyz'[k]} = {middle_m:.2f} m"


def _has_room(figure: Figure, ax: Axes) -> bool:
    """Return whether the names of exit points lie inside the axes; outside, they cover tick labels.

    If not, widen the axes' limits: the drawing shrinks and the names do not.
    """
    figure.draw_without_rendering()
    names = np.array([text.get_window_extent().padded(_PAD).get_points() for text in ax.texts])
    around = ax.transData.inverted().transform(names.reshape(-1, 2))
    low, high = np.array([ax.get_xlim(), ax.get_ylim()]).T
    least, most = around.min(axis=0, initial=np.inf), around.max(axis=0, initial=-np.inf)
    ax.set_xlim(min(low[0], least[0]), max(high[0], most[0]))
    ax.set_ylim(min(low[1], least[1]), max(high[1], most[1]))
    return bool((least >= low).all() and (most <= high).all())


@dataclass(frozen=True)
class _Section:
    """Tension margins in one view, on the grid of `xs_m` to the right and `ys_m` upward."""

    xs_m: FloatArray
    ys_m: FloatArray
    still_N: FloatArray
    """How far tensions can stay from their bounds at rest, in home's orientation."""
    moving_N: FloatArray
    """The same for targets, with their acceleration and reserve, in all their orientations."""

    @classmethod
    def of(cls, statics: PlatformStatics, shown: Box, view: _View) -> _Section:
        platform = statics.platform
        i, j = view
        counts = _FINE if platform.is_planar else _COARSE
        plane = Box((shown.low_m[i], shown.low_m[j]), (shown.high_m[i], shown.high_m[j]))
        cells = plane.grid(*counts)
        middle = np.add(platform.workspace_min_m, platform.workspace_max_m) / 2.0
        points = np.empty((*cells.shape[:2], len(middle)))
        points[:] = middle
        points[..., view] = cells
        acceleration, kept_N = platform.acceleration_m_s2, statics.model.reserve_N
        moving = statics.margin_N(points, acceleration, statics.orientations) - kept_N
        return cls(
            cells[0, :, 0],
            cells[:, 0, 1],
            np.nan_to_num(statics.margin_N(points), neginf=-1e3),
            np.nan_to_num(moving, neginf=-1e3),
        )


def _draw_workspace(figure: Figure, all_axes: list[Axes], sections: list[_Section]) -> None:
    """Draw the sections with a common colour scale and one colour bar."""
    most_N = max(float(section.still_N.max()) for section in sections)
    levels, filled = MaxNLocator(9).tick_values(0.0, most_N), None
    for ax, section in zip(all_axes, sections, strict=True):
        xs, ys = section.xs_m, section.ys_m
        if section.still_N.max() > 0.0:
            filled = ax.contourf(xs, ys, section.still_N, levels, cmap="YlGnBu", alpha=0.75)
        if section.moving_N.max() > 0.0:
            ax.contour(
                xs, ys, section.moving_N, [0.0],
                colors=style.LINES, linestyles="dotted", linewidths=1.0,
            )  # fmt: skip
    if filled is not None:
        label = "distance of all tensions\nfrom their limits, at rest (N)"
        style.colour_bar(figure, filled, all_axes, label, 0.8 / len(sections))
    if any(section.moving_N.max() > 0.0 for section in sections):
        all_axes[0].plot([], [], ":", color=style.LINES, lw=1.0, label="targets are accepted")


def _draw_machine(ax: Axes, robot: Robot, platform: Platform, view: _View) -> None:
    all_exits, home = np.array(platform.exit_points_m), np.array(platform.home_m)[list(view)]
    exits, anchors = all_exits[:, view], home + np.array(platform.anchor_points_m)[:, view]
    for a, b in zip(exits, anchors, strict=True):
        ax.plot(*zip(a, b, strict=True), color=style.LINES, lw=1.2)
    if view == (0, 1):  # in the other views names would cover each other
        _name_all(ax, [axis.name for axis in robot.axes], exits)
    ax.plot([], [], color=style.LINES, lw=1.2, label="cables, at rest")
    ax.plot(*exits.T, "s", ms=6, color=style.LINES, label="exit points")
    outward = np.linspace(0.0, 2.0 * np.pi, _OUTLINE)
    furthest = (np.column_stack((np.cos(outward), np.sin(outward))) @ anchors.T).argmax(axis=1)
    ax.add_patch(Polygon(anchors[furthest], color=_PLATFORM, alpha=_SEEN_THROUGH, zorder=3))
    ax.plot(*home, "o", ms=3, color=_PLATFORM, label="platform, at rest", zorder=3)
    style.box_of_targets(ax, platform.workspace_min_m, platform.workspace_max_m, view)


def _name_all(ax: Axes, names: list[str], exits_m: FloatArray) -> None:
    """Write the names of exit points; those that nearly coincide share one label."""
    close = np.multiply(_TOGETHER, np.ptp(exits_m, axis=0).max())
    together = (np.abs(exits_m[:, None] - exits_m) <= close).all(axis=-1)
    for i, exit_m in enumerate(exits_m):
        alike = np.flatnonzero(together[i])
        if alike[0] == i:
            _name(ax, ", ".join(names[k] for k in alike), exit_m, exits_m)


def _name(ax: Axes, name: str, exit_m: FloatArray, exits_m: FloatArray) -> None:
    """Write a name beside its exit point: outward, and away from a close neighbour."""
    away = exits_m - exit_m
    apart = np.linalg.norm(away, axis=1)
    apart[apart == 0.0] = np.inf
    nearest = apart.argmin()
    up = float(exit_m[1] - exits_m[:, 1].mean())
    beside = apart[nearest] <= _CLOSE * np.ptp(exits_m, axis=0).max()
    right = -float(away[nearest, 0]) if beside else 0.0
    ax.annotate(
        name, tuple(exit_m), xytext=(7.0 * np.sign(right), 9.0 if up >= 0.0 else -9.0),
        textcoords="offset points", va="bottom" if up >= 0.0 else "top",
        ha="center" if right == 0.0 else "left" if right > 0.0 else "right",
    )  # fmt: skip
