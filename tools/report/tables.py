"""The tables of the report; every number carries its full value for programs."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from cdpr_rt.identification.cogging.result import HarmonicResult
from cdpr_rt.identification.confidence import ConfidenceInterval
from cdpr_rt.procedures.commissioning.evaluation import METHODS
from cdpr_tools.report.text import data, number, plain, table
from cdpr_tools.report.words import NAMES, QUANTITIES, Quantity, missed_targets

_COMPENSATED = ("thesis", "better")


def summary(validation: Mapping[str, Any], bandwidth_Hz: float) -> str:
    """Return what each method leaves, gains and should have gained, and the floor."""
    rows = [
        [
            f'{q.name[0].upper()}{q.name[1:]}<span class="small">{q.unit}</span>',
            data(validation["none"][q.key]),
            *(_gain_cell(validation, method, q) for method in _COMPENSATED),
            data(validation["floor"][q.key]),
        ]
        for q in QUANTITIES
    ]
    how = f"PID of {plain(bandwidth_Hz)} Hz, judged on the {validation['judged_on']}"
    return table(["", *NAMES.values(), "Floor"], rows, f"Ramp of 22 deg/s, {how}")


def _gain_cell(validation: Mapping[str, Any], method: str, q: Quantity) -> str:
    mine, goal = validation[method], validation["targets"][method][q.ratio]
    kind, word = (
        ("bad", "missed") if q in missed_targets(validation, method) else ("good", "reached")
    )
    return (
        f'{data(mine[q.key])}<span class="small"><b class="together">'
        f"{data(mine['ratios'][q.ratio])} ×</b> smaller</span>"
        f'<span class="small {kind}">{plain(goal)} asked: {word}</span>'
    )


def on_encoder(judged: Mapping[str, Any]) -> str:
    """Return the same figures as the encoder shows them."""
    rows = [
        [
            f"{q.name[0].upper()}{q.name[1:]} ({q.unit})",
            *(data(judged[method][q.key]) for method in METHODS),
            *(f"{data(judged[m]['ratios'][q.ratio])} ×" for m in _COMPENSATED),
        ]
        for q in QUANTITIES
    ]
    head = ["", *NAMES.values(), "Thesis’ gain", "Harmonic gain"]
    return table(head, rows, "The same runs judged on the encoder, as a real motor is")


def harmonics(identification: Mapping[str, Any]) -> str:
    """Return the orders that were found."""
    rows = [
        [
            str(order),
            plain(identification["per_pole_pair"][i]),
            f"{data(1e3 * identification['amplitudes_Nm'][i])} ± "
            f"{number(1e3 * identification['confidence_Nm'][i], 2)}",
            number(identification["phases_deg"][i]),
            escape(identification["hints"][i]),
        ]
        for i, order in enumerate(identification["orders"])
    ]
    head = ["Order", "Per pole pair", "Amplitude (mNm)", "Phase (deg)", "Usual cause"]
    caption = "Cogging: amplitude·sin(order·angle + phase), angle from the index; ± 95 %"
    return table(head, rows, caption)


def estimates(harmonic: HarmonicResult) -> str:
    """Return what was identified beside the cogging."""
    f = harmonic.friction

    def row(name: str, one: ConfidenceInterval, factor: float = 1.0) -> list[str]:
        known = number(abs(factor) * one.half_width, 2) if one.half_width > 0.0 else "assumed"
        return [name, data(factor * one.value), known]

    drift = 100.0 * 60.0 * harmonic.cogging_trend_1_s
    rise = f"{number(1e3 * f.stribeck_forward_Nm)} / {number(1e3 * f.stribeck_backward_Nm)}"
    rows = [
        row("Coulomb friction, increasing angle (mNm)", harmonic.coulomb_forward_Nm, 1e3),
        row("Coulomb friction, decreasing angle (mNm)", harmonic.coulomb_backward_Nm, 1e3),
        ["Its rise towards standstill, increasing / decreasing (mNm)", rise, "–"],
        [
            "Stribeck speed, at which that rise is down to 37 % (rad/s)",
            number(f.stribeck_speed_rad_s),
            "–",
        ],
        row("Viscous friction (mNm s/rad)", harmonic.viscous_Nms_rad, 1e3),
        row("Rotor inertia (kg mm²)", harmonic.inertia_kg_m2, 1e6),
        row("Delay from angle to torque, as identified (ms)", harmonic.latency_s, 1e3),
        row("Static lag of each direction (deg)", harmonic.lag_rad, math.degrees(1.0)),
        ["Change of the cogging with warmth (% a minute)", number(drift), "–"],
    ]
    return table(["", "Value", "± (95 %)"], rows)


def quality(identification: Mapping[str, Any]) -> str:
    """Return how far the identification can be trusted."""
    percent = {
        "Share of the turn on which the rotor was seen moving": "coverage",
        "Share of the data left out, as the rotor stood or ran back": "excluded_fraction",
        "Share of the thesis’ curves that is repaired": "repaired_fraction",
    }
    rows = [[name, f"{number(100 * identification[key])} %"] for name, key in percent.items()]
    residual = f"{data(1e3 * identification['residual_rms_Nm'])} mNm"
    rows.append(["Torque the fit does not explain (rms)", residual])
    return table([], rows, "How far it can be trusted")


def loops(
    judged: Sequence[Mapping[str, Any]],
    bandwidths_Hz: Sequence[float],
    designs: Sequence[Mapping[str, Any]],
) -> str:
    """Return each loop's margins and what compensation gains in it.

    `designs` belong to `bandwidths_Hz`, one by one.
    """
    margins = {
        bandwidth_Hz: [
            number(one[k]) for k in ("phase_margin_deg", "gain_margin_dB", "sensitivity_peak")
        ]
        for bandwidth_Hz, one in zip(bandwidths_Hz, designs, strict=True)
    }
    rows = [
        [
            plain(row["bandwidth_Hz"]),
            *margins[row["bandwidth_Hz"]],
            *(_gains(row[method]["ratios"]) for method in _COMPENSATED),
        ]
        for row in judged
    ]
    head = ["Bandwidth (Hz)", "Phase margin (deg)", "Gain margin (dB)", "Sensitivity peak"]
    head += ["Thesis’ gains", "Harmonic gains"]
    return table(head, rows, "Gains: position · effort · velocity, times smaller than without")


def _gains(ratios: Mapping[str, float]) -> str:
    shown = " · ".join(data(ratios[q.ratio]) for q in QUANTITIES)
    return f'<span class="together">{shown}</span>'


def bus(facts: Mapping[str, Any]) -> str:
    """Return how the bus was used; what is not known of it is left out."""
    names = {
        "url": "Bus", "cycles": "Cycles", "missed": "Answers missed",
        "late": "Cycles late", "wall_s": "Time taken (s)", "load": "Bus load, mean",
        "peak_cycle_load": "Bus load, fullest cycle", "overruns": "Overruns",
    }  # fmt: skip
    rows = [
        [name, number(facts[key]) if isinstance(facts[key], float) else escape(str(facts[key]))]
        for key, name in names.items()
        if facts.get(key) is not None
    ]
    if facts.get("period_s"):
        rows.insert(1, ["Cycle (ms)", plain(1e3 * facts["period_s"])])
    if facts.get("wall_s") and facts.get("cycles"):
        rows.append(
            ["Times real time", number(facts["cycles"] * facts["period_s"] / facts["wall_s"])]
        )
    return table([], rows)
