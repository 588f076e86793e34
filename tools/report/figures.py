"""The pictures of the report; each function draws one from arrays and returns it embedded."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from cdpr_rt.exchange import BoolArray, FloatArray
from tools.report.style import BACKWARD, COLOURS, FORWARD, LABELS, canvas, embedded


def raw_curves(forward_Nm: FloatArray, backward_Nm: FloatArray) -> str:
    """Draw the averaged torque over one turn for both directions (Tremblay, figure 1.4)."""
    figure, (ax,) = canvas()
    for curve, colour, name in (
        (forward_Nm, FORWARD, "increasing angle"),
        (backward_Nm, BACKWARD, "decreasing angle"),
    ):
        ax.plot(np.linspace(0, 360, curve.size, endpoint=False), curve, color=colour, label=name)
    ax.set(xlabel="angle from the index (deg)", ylabel="torque (Nm)", xlim=(0, 360))
    ax.legend(loc="center right")
    return embedded(figure)


def overlay(variation_Nm: FloatArray, order: int) -> str:
    """Draw both directions' variations over one period of `order` (Tremblay, figure 1.5)."""
    figure, (ax,) = canvas()
    span = variation_Nm.shape[1] // order
    degrees = np.arange(span) * 360.0 / variation_Nm.shape[1]
    ax.plot(degrees, variation_Nm[0, :span], color=FORWARD, label="increasing angle")
    ax.plot(degrees, variation_Nm[1, :span], color=BACKWARD, label="decreasing angle")
    ax.set(xlabel=f"angle within one of {order} periods (deg)", ylabel="torque variation (Nm)")
    ax.legend()
    return embedded(figure)


def tables(
    raw_Nm: FloatArray, thesis_Nm: FloatArray, better_Nm: FloatArray, repaired: BoolArray
) -> str:
    """Draw measured torque and both methods' tables, (2, m) each (Tremblay, figures 1.6, 1.7).

    `better_Nm` holds the harmonic model with its friction; `repaired` marks what the thesis'
    method took from the other direction.
    """
    figure, axes = canvas(rows=2, height=2.6)
    degrees = np.linspace(0, 360, raw_Nm.shape[1], endpoint=False)
    for side, ax in enumerate(axes):
        ax.plot(degrees, raw_Nm[side], color=COLOURS["none"], lw=0.6, label="measured, averaged")
        ax.plot(degrees, thesis_Nm[side], color=COLOURS["thesis"], label=LABELS["thesis"])
        ax.plot(degrees, better_Nm[side], color=COLOURS["better"], label=LABELS["better"])
        if repaired[side].any():
            low, high = ax.get_ylim()
            ax.fill_between(
                degrees, low, high, where=repaired[side], color="#f3c623", alpha=0.3, lw=0,
                label="runaway, repaired",
            )  # fmt: skip
            ax.set_ylim(low, high)
        way = "increasing" if side == 0 else "decreasing"
        ax.set(ylabel="torque (Nm)", xlim=(0, 360), title=f"{way} angle")
    axes[0].legend(ncols=2, fontsize=8)
    axes[1].set_xlabel("angle from the index (deg)")
    return embedded(figure)


def spectrum(orders: Sequence[int], amplitudes_Nm: FloatArray, confidence_Nm: FloatArray) -> str:
    """Draw the identified harmonics with their 95 % confidence intervals."""
    figure, (ax,) = canvas(height=2.6)
    places = np.arange(len(orders))
    ax.bar(places, amplitudes_Nm * 1e3, color=COLOURS["better"], width=0.6)
    ax.errorbar(
        places, amplitudes_Nm * 1e3, confidence_Nm * 1e3, fmt="none", ecolor="black", capsize=3
    )
    ax.set_xticks(places, [str(order) for order in orders])
    ax.set(xlabel="order (periods per motor turn)", ylabel="amplitude (mNm)")
    return embedded(figure)


def tracking(
    time_s: FloatArray,
    errors_deg: Mapping[str, FloatArray],
    efforts_Nm: Mapping[str, FloatArray],
) -> str:
    """Draw position error and PID effort on the ramp, by method (Tremblay, figure 1.9)."""
    figure, (top, bottom) = canvas(rows=2, height=2.6)
    for method, error in errors_deg.items():
        top.plot(time_s[: error.size], error, color=COLOURS[method], label=LABELS[method])
    for method, effort in efforts_Nm.items():
        bottom.plot(time_s[: effort.size], effort, color=COLOURS[method], lw=0.8)
    top.set(ylabel="position error (deg)")
    top.legend(ncols=3, fontsize=8)
    bottom.set(ylabel="PID effort (Nm)", xlabel="time (s)")
    return embedded(figure)


def velocity(time_s: FloatArray, errors_deg_s: Mapping[str, FloatArray]) -> str:
    """Draw the velocity error on the ramp, by method (Tremblay, figure 1.10)."""
    figure, (ax,) = canvas()
    for method, error in errors_deg_s.items():
        ax.plot(time_s[: error.size], error, color=COLOURS[method], label=LABELS[method], lw=0.8)
    ax.set(xlabel="time (s)", ylabel="velocity error (deg/s)")
    ax.legend(ncols=3, fontsize=8)
    return embedded(figure)


def bandwidths(rows: Sequence[Mapping[str, Any]]) -> str:
    """Draw what each method leaves and gains over the loop's bandwidth.

    Each row holds `bandwidth_Hz`, and for each method and for `floor` the three figures.
    """
    figure, axes = canvas(rows=2, columns=3, height=2.5)
    x = [row["bandwidth_Hz"] for row in rows]
    quantities = (
        ("rms_position_error_deg", "RMS position error (deg)"),
        ("peak_pid_effort_Nm", "peak PID effort (Nm)"),
        ("peak_velocity_error_deg_s", "peak velocity error (deg/s)"),
    )
    for column, (key, label) in enumerate(quantities):
        left, gained = axes[column], axes[3 + column]
        for method in ("none", "thesis", "better", "floor"):
            y = [row[method][key] for row in rows]
            style = "--" if method == "floor" else "o-"
            left.plot(x, y, style, color=COLOURS[method], label=LABELS[method], ms=3)
        for method in ("thesis", "better"):
            y = [row["none"][key] / row[method][key] for row in rows]
            gained.plot(x, y, "o-", color=COLOURS[method], ms=3)
        left.set(yscale="log", title=label)
        gained.set(yscale="log", title="times smaller than without", xlabel="bandwidth (Hz)")
    axes[0].legend(fontsize=6)
    return embedded(figure)
