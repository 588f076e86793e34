"""The report of a commissioning: a page with pictures, and the results beside it."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from cdpr_profiles import Winch
from cdpr_rt.identification.commissioning_results import METHODS, Identified, Paths, validation_name
from cdpr_rt.identification.rawlog import read_raw_log
from cdpr_tools.commission import curves, figures
from cdpr_tools.commission.curves import Ramp, ResidualEffort
from cdpr_tools.errors import BadInputError
from cdpr_tools.output import to_json
from cdpr_tools.recordings.truth import Truth
from cdpr_tools.rendering import rendered
from cdpr_tools.saving import save

_SPEEDS_RAD_S = (math.radians(1.0), math.radians(600.0))
_ORDERS_SHOWN = 100
_NEAR_FLOOR = 2.0
_FLAT = 0.98


class _Quantity(NamedTuple):
    """One of the three figures of the validation."""

    ratio: str
    """Key of the quantity among the ratios."""
    unit: str
    key: str
    name: str

    @property
    def title(self) -> str:
        return self.name[0].upper() + self.name[1:]


_QUANTITIES = (
    _Quantity("rms_position_error", "deg", "rms_position_error_deg", "RMS position error"),
    _Quantity("peak_pid_effort", "Nm", "peak_pid_effort_Nm", "peak PID effort"),
    _Quantity("peak_velocity_error", "deg/s", "peak_velocity_error_deg_s", "peak velocity error"),
)


def build(paths: Paths, winch: Winch, results: dict[str, Any], found: Identified) -> None:
    """Write the report's page and the results beside it.

    Raises WorkFailedError if a file cannot be written, BadInputError for missing recordings or a
    missing log of the simulator, RawLogError for unusable recordings.
    """
    save(paths.results, to_json(results, indent=1) + "\n")
    judged, thesis, harmonic = results["validation"], found.thesis, found.harmonic
    on_true_angle = judged["judged_on"] == "true angle"
    truth = Truth(paths.truth) if on_true_angle else None
    passes = {m: _recorded(paths, validation_name(m, results["bandwidth_Hz"])) for m in METHODS}
    ramps = {method: curves.read_ramp(some[0], truth) for method, some in passes.items()}
    left = curves.read_residual_effort(passes["harmonic"], _ORDERS_SHOWN)
    speed_rad_s = abs(read_raw_log(_recorded(paths, "sweep")[0]).header["speed_rad_s"])
    order = curves.strongest_order(harmonic)
    filtered = [(h.order, curves.filter_gain(h.order)) for h in harmonic.harmonics]
    above_floor = {
        method: {
            q.name: judged[method][q.key] / judged["floor"][q.key]
            for q in _QUANTITIES
            if judged["floor"][q.key] > 0.0
        }
        for method in ("none", "harmonic")
    }
    text = rendered(
        "commissioning.html.j2",
        title=f"Commissioning of {winch.name}",
        motor=winch.motor,
        paths=paths,
        results=results,
        found=found,
        pictures=_pictures(results, found, ramps, left, order),
        quantities=_QUANTITIES,
        missed={method: _missed(judged, method) for method in METHODS[1:]},
        on_true_angle=on_true_angle,
        both_ways=len(passes["harmonic"]) > 1,
        speed_deg_s=math.degrees(speed_rad_s),
        order=order,
        shift_deg=curves.shift_deg(thesis.raw_Nm, order),
        friction_Nm=curves.friction_Nm(harmonic, speed_rad_s),
        cogging_peak_Nm=float(abs(harmonic.tables(3600)).max()),
        deg_per_rad=math.degrees(1.0),
        ramps=ramps,
        above_floor=above_floor,
        near_floor=[name for name, n in above_floor["harmonic"].items() if n <= _NEAR_FLOOR],
        table_errors=curves.table_errors(thesis, harmonic),
        flattened=[(order, gain) for order, gain in filtered if gain < _FLAT],
        left=left,
        largest_order=int(left.amplitudes_Nm.max(axis=0).argmax()) + 1,
        folder=results["files"]["report"].rpartition("/")[0] or ".",
        bus_facts=bus_facts(results["bus"]),
    )
    save(paths.page, text)


def _recorded(paths: Paths, name: str) -> list[Path]:
    if not (passes := paths.passes(name)):
        raise BadInputError(f"{paths.raw(name + '-0')}: the recording is missing")
    return passes


def _pictures(
    results: dict[str, Any],
    found: Identified,
    ramps: dict[str, Ramp],
    left: ResidualEffort,
    order: int,
) -> dict[str, str | None]:
    """Draw the pictures; the picture of bandwidths is None if there was only one bandwidth."""
    judged, facts = results["validation"], results["identification"]
    thesis, harmonic = found.thesis, found.harmonic
    tables_Nm = harmonic.tables(thesis.raw_Nm.shape[1]) + thesis.mean_Nm[:, None]
    amplitudes, widths, by_orders = (
        np.asarray(facts[key], float)
        for key in ("amplitudes_Nm", "confidence_Nm", "error_by_orders_Nm")
    )
    speeds = np.geomspace(*_SPEEDS_RAD_S, 200)
    frictions = np.array([curves.friction_Nm(harmonic, one) for one in speeds.tolist()]).T
    time_s = max((ramp.time_s for ramp in ramps.values()), key=len)

    def deviations(key: str, figure: str, label: str, floor_label: str) -> str:
        drawn = {method: getattr(ramp, key) for method, ramp in ramps.items()}
        what = figures.Deviation(label, judged["floor"][figure], floor_label)
        return figures.deviations(time_s, drawn, what)

    position, effort, velocity = (q.key for q in _QUANTITIES)
    several = len(judged["bandwidths"]) > 1
    return {
        "raw": figures.raw_curves(thesis.raw_Nm),
        "overlay": figures.overlay(thesis.raw_Nm, order),
        "tables": figures.tables(thesis.raw_Nm, thesis.curve_Nm, tables_Nm, thesis.repaired),
        "spectrum": figures.spectrum(facts["orders"], amplitudes, widths, by_orders),
        "friction": figures.friction(speeds, *frictions),
        "position": deviations(
            "position_error_deg", position, "position error (deg)", "floor (rms, deg)"
        ),
        "effort": deviations("effort_Nm", effort, "PID effort (Nm)", "floor (peak, Nm)"),
        "velocity": deviations(
            "velocity_error_deg_s", velocity, "velocity error (deg/s)", "floor (peak, deg/s)"
        ),
        "residual": figures.residual_effort(left, facts["orders"]),
        "bandwidths": figures.bandwidths(
            judged["bandwidths"], results["bandwidth_Hz"], judged["targets"]
        )
        if several
        else None,
    }


def bus_facts(bus: dict[str, Any]) -> dict[str, Any]:
    """Return the facts about the bus, with the cycle in ms and the bit rate if they are known."""
    facts = dict(bus)
    if bus.get("period_s"):
        facts["period_ms"] = f"{1e3 * bus['period_s']:g}"
    if bus.get("wall_s") and bus.get("cycles"):
        facts["speed"] = bus["cycles"] * bus["period_s"] / bus["wall_s"]
    return facts


def _missed(judged: dict[str, Any], method: str) -> list[_Quantity]:
    """Return the figures in which a method does not reach its targets."""
    goals, got = judged["targets"][method], judged[method]["ratios"]
    return [q for q in _QUANTITIES if got[q.ratio] is not None and got[q.ratio] < goals[q.ratio]]
