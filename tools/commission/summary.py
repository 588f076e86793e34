"""The table that a commissioning prints at its end."""

from __future__ import annotations

from typing import Any

from cdpr_rt.identification.commissioning_results import METHODS
from cdpr_tools.commission.commissioning import NAMES
from cdpr_tools.output import Output, TableText


def show(out: Output, results: dict[str, Any]) -> None:
    """Print the identified model and the comparison of the methods."""
    show_identified(out, results["identification"])
    show_validation(out, results["validation"], results["bandwidth_Hz"])
    _show_shortfall(out, results["validation"])
    _show_loop(out, results["pid"][0])
    bus = results["bus"]
    seconds = bus["cycles"] * bus["period_s"]
    out.say(
        f"{bus['cycles']} cycles, {seconds / 60.0:.1f} min of bus time in {bus['wall_s']:.0f} s "
        f"({seconds / bus['wall_s']:.1f} times real time), "
        f"{bus.get('overruns', 'unknown')} bus overruns"
    )
    out.say(f"report:  {results['files']['report']}")
    out.say(f"profile: {results['files']['profile']}")


def show_identified(out: Output, found: dict[str, Any]) -> None:
    """Print the identified model."""
    columns = (found[key] for key in ("orders", "amplitudes_Nm", "confidence_Nm", "hints"))
    rows = [
        [str(order), f"{1e3 * amplitude:.2f} mNm", f"± {1e3 * width:.2f} mNm", hint]
        for order, amplitude, width, hint in zip(*columns, strict=True)
    ]
    head = ["order", "amplitude", "95 %", "likely cause"]
    out.say("identified cogging", TableText([head, *rows], left=["likely cause"]))
    forward, backward = (1e3 * found[f"coulomb_{way}_Nm"] for way in ("forward", "backward"))
    both = f"friction {forward:.1f} / {backward:.1f} mNm forward / backward"
    if len(found["directions"]) == 1:
        way = "increasing" if found["directions"][0] > 0 else "decreasing"
        both = f"friction {forward:.1f} mNm, measured at {way} angle only and assumed for both"
    out.say(
        f"{both}, inertia {found['inertia_kg_m2']:.3e} kg m2, "
        f"unexplained {1e3 * found['residual_rms_Nm']:.2f} mNm RMS",
        "thesis' method: the rotor left the ramp, and the curve of the other direction "
        "was used, at "
        f"{100 * found['repaired_fraction']:.1f} % of the angles",
    )
    if found["dropped_fraction"] > 0.0:
        out.say(
            f"{found['dropped_fraction']:.1%} of the samples were not used: they lie between jumps "
            "of the time that are less than 100 samples apart"
        )


def show_validation(out: Output, validation: dict[str, Any], bandwidth_Hz: float) -> None:
    """Print the comparison of the methods on the ramps of one bandwidth."""
    title = (
        f"ramp of 22 deg/s under one PID of {bandwidth_Hz:g} Hz closed-loop bandwidth, "
        f"judged on the {validation['judged_on']} (times smaller than without)"
    )
    rows = [["", "RMS position error", "peak PID effort", "peak velocity error"]]
    for method in METHODS:
        figures, ratios = validation[method], validation[method]["ratios"]
        cells = (
            f"{figures['rms_position_error_deg']:.4f} deg",
            f"{1e3 * figures['peak_pid_effort_Nm']:.2f} mNm",
            f"{figures['peak_velocity_error_deg_s']:.2f} deg/s",
        )
        gains = [f" ({ratio:.1f}x)" if method != "none" else "" for ratio in ratios.values()]
        rows.append([NAMES[method], *(c + g for c, g in zip(cells, gains, strict=True))])
    out.say(title, TableText(rows))


def _show_loop(out: Output, design: dict[str, Any]) -> None:
    out.say(
        f"loop tuned to {design['bandwidth_Hz']:.3g} Hz: phase margin "
        f"{design['phase_margin_deg']:.0f} deg, gain margin {design['gain_margin_dB']:.1f} dB, "
        f"sensitivity at most {design['sensitivity_peak']:.2f}"
    )


def _show_shortfall(out: Output, validation: dict[str, Any]) -> None:
    for method in ("thesis", "harmonic"):
        ratios, targets = validation[method]["ratios"], validation["targets"][method]
        missed = [
            f"{key.replace('_', ' ')} {ratios[key]:.1f} of {targets[key]:g}"
            for key in targets
            if ratios[key] < targets[key]
        ]
        if missed:
            out.say(
                f"{NAMES[method]}: below its target in {', '.join(missed)}; the report explains why"
            )
