"""The pictures of the report; each function draws one from arrays and returns its data URI."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

from cdpr_rt.arrays import BoolArray, FloatArray
from cdpr_tools.commission.curves import ResidualEffort
from cdpr_tools.style import (
    BACKWARD,
    COLOURS,
    DIRECTIONS,
    FORWARD,
    LABELS,
    REPAIRED,
    canvas,
    data_uri,
    decimated,
    legend_above,
    legend_beside_title,
)

_WIDE_SPREAD = 30.0
_TURN_TICKS_deg = np.arange(0, 361, 45)


def _over_turn(ax: Axes) -> None:
    ax.set(xlim=(0, 360), xticks=_TURN_TICKS_deg)


def _turn_deg(samples: int) -> FloatArray:
    return np.asarray(np.arange(samples) * (360.0 / samples))


def _log_labels(axis: Axis) -> None:
    """Label a logarithmic axis with few, plain numbers."""
    low, high = axis.get_view_interval()
    steps = (1.0, 2.0, 5.0) if high < 50.0 * low else (1.0,)
    axis.set_major_locator(LogLocator(subs=steps))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


def raw_curves(raw_Nm: FloatArray) -> str:
    """Draw the averaged torque of both directions, (2, m), over a turn (Tremblay, figure 1.4)."""
    figure, (ax,) = canvas(height=3.2)
    for curve, colour, name in zip(raw_Nm, (FORWARD, BACKWARD), DIRECTIONS, strict=True):
        ax.plot(*decimated(_turn_deg(curve.size), curve), color=colour, label=name, lw=0.9)
    ax.axhline(0.0, color="black", lw=0.5)
    ax.set(xlabel="angle from the index (deg)", ylabel="torque (Nm)")
    _over_turn(ax)
    legend_above(figure, ax)
    return data_uri(figure)


def overlay(raw_Nm: FloatArray, order: int) -> str:
    """Draw both directions about their means over one period (Tremblay, figure 1.5).

    `raw_Nm` (2, m) covers a turn; the period is that of `order`.
    """
    figure, (ax,) = canvas(height=3.0)
    inside = _turn_deg(raw_Nm.shape[1]) < 360.0 / order
    degrees = _turn_deg(raw_Nm.shape[1])[inside]
    for curve, colour, name in zip(raw_Nm, (FORWARD, BACKWARD), DIRECTIONS, strict=True):
        ax.plot(degrees, (curve - curve.mean())[inside], color=colour, label=name)
    ax.axhline(0.0, color="black", lw=0.5)
    ax.set(xlabel="angle from the index (deg)", ylabel="torque about its mean (Nm)")
    ax.set_xlim(0, 360.0 / order)
    legend_above(figure, ax)
    return data_uri(figure)


def tables(
    raw_Nm: FloatArray, thesis_Nm: FloatArray, harmonic_Nm: FloatArray, repaired: BoolArray
) -> str:
    """Draw measured torque and both methods' curves, (2, m) each (Tremblay, figures 1.6, 1.7).

    `repaired` marks the part that the thesis' method took from the other direction.
    """
    figure, axes = canvas(rows=2, height=2.8, sharex=True)
    degrees = _turn_deg(raw_Nm.shape[1])
    for side, ax in enumerate(axes):
        measured = decimated(degrees, raw_Nm[side])
        ax.plot(*measured, color=COLOURS["none"], lw=2.2, alpha=0.6, label="measured, averaged")
        ax.plot(degrees, thesis_Nm[side], color=COLOURS["thesis"], label="thesis: filtered")
        ax.plot(degrees, harmonic_Nm[side], color=COLOURS["harmonic"], label=LABELS["harmonic"])
        low, high = ax.get_ylim()
        ax.fill_between(
            degrees, low, high, where=repaired[side], color=REPAIRED, alpha=0.35, lw=0,
            label="rotor left the ramp: repaired",
        )  # fmt: skip
        ax.set(ylabel="torque (Nm)", ylim=(low, high), title=DIRECTIONS[side])
        _over_turn(ax)
    axes[1].set_xlabel("angle from the index (deg)")
    legend_above(figure, axes[0])
    return data_uri(figure)


def spectrum(
    orders: Sequence[int],
    amplitudes_Nm: FloatArray,
    confidence_Nm: FloatArray,
    error_Nm: FloatArray,
) -> str:
    """Draw the harmonics with 95 % intervals, and how their number was chosen.

    `error_Nm` (k + 1,) is the residual with the 0, 1, ... most significant orders.
    """
    figure, (left, right) = canvas(columns=2, height=3.0)
    places = np.arange(len(orders))
    left.errorbar(
        places, amplitudes_Nm * 1e3, confidence_Nm * 1e3,
        fmt="o", ms=4, capsize=4, color=COLOURS["harmonic"], ecolor="black", elinewidth=1,
    )  # fmt: skip
    if len(orders) and amplitudes_Nm.max() > _WIDE_SPREAD * amplitudes_Nm.min():
        left.set_yscale("log")
        _log_labels(left.yaxis)
    elif len(orders):
        left.set_ylim(0.0, 1.15e3 * float((amplitudes_Nm + confidence_Nm).max()))
    left.vlines(
        places, left.get_ylim()[0], amplitudes_Nm * 1e3, color=COLOURS["harmonic"], lw=5, alpha=0.35
    )
    left.set_xticks(places, [str(order) for order in orders], rotation=60 * (len(orders) > 10))
    left.set_xlim(-0.7, len(orders) - 0.3)
    left.set(xlabel="order (periods a turn)", ylabel="amplitude (mNm)", title="Found")
    count = np.arange(error_Nm.size)
    right.plot(count, error_Nm * 1e3, ".-", color=COLOURS["none"], ms=4)
    chosen = min(len(orders), error_Nm.size - 1)
    right.plot(chosen, error_Nm[chosen] * 1e3, "o", color=COLOURS["harmonic"], label="chosen")
    right.set(xlabel="number of orders", ylabel="residual (mNm RMS)", title="Choice")
    right.set_yscale("log")
    _log_labels(right.yaxis)
    legend_beside_title(right)
    return data_uri(figure)


def friction(speed_rad_s: FloatArray, forward_Nm: FloatArray, backward_Nm: FloatArray) -> str:
    """Draw the model's friction over the speed (k,) for each direction (k,), on one axis."""
    figure, (ax,) = canvas(height=2.4)
    speed = np.degrees(speed_rad_s)
    pairs = ((forward_Nm, FORWARD), (-backward_Nm, BACKWARD))
    for (torque, colour), label in zip(pairs, DIRECTIONS, strict=True):
        ax.semilogx(speed, 1e3 * torque, color=colour, label=label)
    ax.set(xlabel="speed (deg/s)", ylabel="friction (mNm)")
    ax.set_ylim(bottom=0.0)
    legend_above(figure, ax)
    return data_uri(figure)


@dataclass(frozen=True)
class Deviation:
    """Label of the axis for one figure of merit, and its floor."""

    label: str
    floor: float
    floor_label: str


def deviations(time_s: FloatArray, curves: Mapping[str, FloatArray], what: Deviation) -> str:
    """Draw a deviation on the ramp by method, and again on the scale of the best method.

    Tremblay, figures 1.9 and 1.10; the second panel also has the floor as a band.
    """
    figure, (whole, near) = canvas(rows=2, height=2.3, sharex=True)
    for method, curve in curves.items():
        x, y = decimated(time_s[: curve.size], curve)
        whole.plot(x, y, color=COLOURS[method], label=LABELS[method], lw=0.9)
        faint = 1.0 if method == "harmonic" else 0.6
        near.plot(x, y, color=COLOURS[method], lw=0.7, alpha=faint)
    # with an edge, so that it is visible even if it is thinner than a line
    near.axhspan(
        *(-what.floor, what.floor), color=COLOURS["floor"], alpha=0.35, lw=1.2, zorder=3.0,
        label=f"{what.floor_label}: {what.floor:.1g}",
    )  # fmt: skip
    limit = 1.6 * max(float(np.abs(curves["harmonic"]).max()), 1.2 * what.floor)
    near.set(ylim=(-limit, limit), xlabel="time (s)", title="the same, enlarged")
    whole.set_xlim(0.0, time_s[-1])
    figure.supylabel(what.label, fontsize=9.5)
    legend_above(figure, whole, near)
    return data_uri(figure)


def bandwidths(
    rows: Sequence[Mapping[str, Any]], default_Hz: float, targets: Mapping[str, Mapping[str, float]]
) -> str:
    """Draw the remaining error and the gain of each method over the loop's bandwidth.

    Each row holds `bandwidth_Hz`, and the three figures for each method and for `floor`. Targets
    are drawn at the default bandwidth, to which they apply.
    """
    figure, axes = canvas(rows=3, columns=2, height=2.3, sharex=True)
    x = [row["bandwidth_Hz"] for row in rows]
    quantities = (
        ("rms_position_error", "_deg", "RMS position\nerror (deg)"),
        ("peak_pid_effort", "_Nm", "peak PID\neffort (Nm)"),
        ("peak_velocity_error", "_deg_s", "peak velocity\nerror (deg/s)"),
    )
    for (key, unit, label), left, gained in zip(quantities, axes[::2], axes[1::2], strict=True):
        for method in ("none", "thesis", "harmonic", "floor"):
            y = [row[method][key + unit] for row in rows]
            style = "--" if method == "floor" else "o-"
            left.plot(x, y, style, color=COLOURS[method], label=LABELS[method], ms=3.5)
        for method in ("thesis", "harmonic"):
            y = [row[method]["ratios"][key] for row in rows]
            known = [np.nan if one is None else one for one in y]
            gained.plot(x, known, "o-", color=COLOURS[method], ms=3.5)
            goal = targets[method][key]
            gained.plot(default_Hz, goal, marker="_", ms=16, mew=2.0, color=COLOURS[method])
        gained.axhline(1.0, color="black", lw=0.5)
        for ax in (left, gained):
            ax.axvline(default_Hz, color="black", lw=0.5, ls=":")
            ax.set(yscale="log", xscale="log", xticks=x, xticklabels=[f"{one:g}" for one in x])
            ax.xaxis.set_minor_locator(NullLocator())
            _log_labels(ax.yaxis)
        left.set_ylabel(label)
    axes[0].set_title("error with each method")
    axes[1].set_title("times smaller than without compensation")
    for ax in axes[-2:]:
        ax.set_xlabel("closed-loop bandwidth (Hz)")
    legend_above(figure, axes[0])
    return data_uri(figure)


def residual_effort(left: ResidualEffort, orders: Sequence[int]) -> str:
    """Draw the remaining PID effort under the harmonic model over the turn, and its orders.

    `orders` are the orders of the model.
    """
    figure, (top, bottom) = canvas(rows=2, height=2.6)
    degrees = _turn_deg(left.effort_Nm.shape[1])
    count = np.arange(1, left.amplitudes_Nm.shape[1] + 1)
    for row, forward in enumerate(left.forward):
        colour, name = (FORWARD, DIRECTIONS[0]) if forward else (BACKWARD, DIRECTIONS[1])
        top.plot(degrees, left.effort_Nm[row] * 1e3, color=colour, lw=0.9, label=name)
        bottom.plot(count, left.amplitudes_Nm[row] * 1e3, ".-", color=colour, lw=0.7, ms=3)
    top.set(xlabel="angle from the index (deg)", ylabel="PID effort (mNm)")
    _over_turn(top)
    for order in orders:
        bottom.axvline(order, color=COLOURS["harmonic"], lw=5, alpha=0.18)
    bottom.set(xlabel="order (periods a turn)", ylabel="amplitude (mNm)", xlim=(0, count[-1]))
    bottom.set_ylim(bottom=0.0)
    legend_above(figure, top)
    return data_uri(figure)
