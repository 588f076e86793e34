"""Synthetic files of a commissioning with known figures, without bus or simulator."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_rt.control.compensation import FrictionFeedforward
from cdpr_rt.control.tuning import design_pid
from cdpr_rt.identification.commissioning_results import Identified, Paths, legs, validation_name
from cdpr_rt.identification.rawlog import RawLogWriter, column_names
from cdpr_rt.identification.result import ConfidenceInterval, Harmonic, HarmonicResult
from cdpr_rt.identification.thesis import identify_thesis
from cdpr_rt.identification.windows import FrictionShape
from cdpr_tools.commission.commissioning import Pass

PERIOD_s = 2e-3
COUNTS = 8192
INDEX_rad = 0.7
SYNC_OFFSET = 40
AMPLITUDES_Nm = {4: 0.05, 24: 0.02}
COULOMB_Nm = 0.08
ERROR_deg = {"none": 4.0, "thesis": 0.9, "harmonic": 0.2}
EFFORT_Nm = {"none": 0.08, "thesis": 0.01, "harmonic": 0.004}
ERROR_ORDER = 4
LATENCY_s = 2.8e-3


class MadeUp:
    """Write recordings like those of one device, and the simulator's log."""

    def __init__(self, out: Path) -> None:
        self.paths = Paths(out)
        self._cycle = 100
        self._truth: list[tuple[int, float]] = []

    def record(
        self,
        name: str,
        what: Pass,
        error: Callable[[np.ndarray], np.ndarray],
        effort: Callable[[np.ndarray], np.ndarray],
    ) -> Path:
        """Write one pass with `error` and `effort` as functions of the set-point from the index."""
        move = what.move(np.array([INDEX_rad]))
        begin, end = what.measured()
        time_s = np.arange(round(what.duration_s() / PERIOD_s)) * PERIOD_s
        cruise = np.clip(time_s - what.ramp_s, 0.0, move.cruise_s)
        up = np.minimum(time_s, what.ramp_s)
        down = np.clip(time_s - what.ramp_s - move.cruise_s, 0.0, what.ramp_s)
        way = 0.5 * up**2 / what.ramp_s + cruise + down - 0.5 * down**2 / what.ramp_s
        setpoint = what.speed_rad_s * way
        velocity = what.speed_rad_s * (up / what.ramp_s - down / what.ramp_s)
        true = setpoint - error(setpoint)
        step = math.tau / COUNTS
        cycle = self._cycle + 1 + np.arange(time_s.size)
        columns = {
            "cycle": cycle, "time_s": cycle * PERIOD_s, "setpoint_rad[0]": setpoint + INDEX_rad,
            "setpoint_velocity_rad_s[0]": velocity,
            "position_rad[0]": np.round(true / step) * step + INDEX_rad,
            "torque_sent_Nm[0]": cogging(true) + COULOMB_Nm * np.sign(what.speed_rad_s),
            "effort_Nm[0]": effort(setpoint), "valid[0]": 1.0, "index_rad[0]": INDEX_rad,
            "index_known[0]": 1.0,
        }  # fmt: skip
        rows = np.zeros((time_s.size, len(column_names(1))))
        for place, column in enumerate(column_names(1)):
            rows[:, place] = columns.get(column, 0.0)
        path = self.paths.raw(name)
        log = RawLogWriter(path, column_names(1), {
            "period_s": PERIOD_s, "speed_rad_s": what.speed_rad_s, "measured_from_s": begin,
            "measured_until_s": end, "first_cycle": self._cycle + 1, "sync_offset": SYNC_OFFSET,
        })  # fmt: skip
        log.write(rows)
        log.close()
        sync = cycle + SYNC_OFFSET - 1
        self._truth += list(zip(sync.tolist(), true.tolist(), strict=True))
        self._cycle = int(cycle[-1])
        return path

    def write_truth(self) -> None:
        fields = [["sync_index", "<u8"], ["angle_from_index_rad", "<f8"]]
        fields += [["temperature_rise_K", "<f4"]]
        dtype = np.dtype([(name, kind) for name, kind in fields])
        records = np.zeros(self._truth[-1][0] + 1, dtype)
        records["sync_index"] = np.arange(records.size)
        # the simulator counts from a different turn of the index than the drive latched
        for sync, angle in self._truth:
            records["angle_from_index_rad"][sync] = angle - math.tau
        header = {"format": "cdpr-rt truth log 1", "record_bytes": dtype.itemsize, "fields": fields}
        head = json.dumps(header).encode().ljust(1024)
        self.paths.truth.write_bytes(head + records.tobytes())


def cogging(angle: np.ndarray) -> np.ndarray:
    return np.asarray(sum(a * np.sin(n * angle) for n, a in AMPLITUDES_Nm.items()))


def harmonic_result() -> HarmonicResult:
    """Return the model of the synthetic motor."""
    nothing = ConfidenceInterval(0.0, 1e-5)
    return HarmonicResult(
        harmonics=tuple(
            Harmonic(
                n,
                0.0,
                a,
                ConfidenceInterval(a, 2e-4),
                ConfidenceInterval(0.0, 0.1),
                n / 4,
                f"cause of {n}",
            )
            for n, a in AMPLITUDES_Nm.items()
        ),
        friction=FrictionFeedforward(COULOMB_Nm, COULOMB_Nm, 0.02, 0.01, 0.3, 5e-4),
        shape=FrictionShape(),
        coulomb_forward_Nm=ConfidenceInterval(COULOMB_Nm, 1e-3),
        coulomb_backward_Nm=ConfidenceInterval(COULOMB_Nm, 1e-3),
        viscous_Nms_rad=ConfidenceInterval(5e-4, 1e-4),
        inertia_kg_m2=ConfidenceInterval(1.13e-4, 1e-6),
        inertia_measured=True,
        latency_s=ConfidenceInterval(LATENCY_s, 1e-4),
        lag_rad=nothing,
        pole_pairs=4,
        slots=None,
        directions=(1, -1),
        coverage=1.0,
        cogging_trend_1_s=-1e-5,
        dropped_fraction=0.0,
        excluded_fraction=0.01,
        residual_rms_Nm=1.5e-3,
        error_by_orders_Nm=np.array([0.04, 0.015, 0.0015, 0.0016]),
        remainder_Nm=np.zeros(4),
    )


@dataclasses.dataclass(frozen=True)
class Commissioned:
    """The files, the results of the bus run, and the identified models."""

    paths: Paths
    run: dict[str, Any]
    found: Identified


def make_up(out: Path, both_ways: bool, bandwidths_Hz: tuple[float, ...]) -> Commissioned:
    """Write the files of a commissioning, with a default bandwidth of 8 Hz."""
    made = MadeUp(out)
    for number, sign in enumerate((1.0, -1.0)):
        slow = Pass(sign * math.radians(40.0), 0.3, math.tau)
        made.record(f"sweep-{number}", slow, np.zeros_like, np.zeros_like)
    for bandwidth in bandwidths_Hz:
        softer = 8.0 / bandwidth
        for method in ("none", "thesis", "harmonic"):
            error, effort = (
                (lambda x, a=a * softer: a * np.sin(ERROR_ORDER * x))
                for a in (math.radians(ERROR_deg[method]), EFFORT_Nm[method])
            )
            signs = (1.0, -1.0) if both_ways and bandwidth == 8.0 else (1.0,)
            for number, sign in enumerate(signs):
                ramp = Pass(sign * math.radians(22.0), math.tau if both_ways else 1.0, math.tau)
                name = f"{validation_name(method, bandwidth)}-{number}"
                made.record(name, ramp, error, effort)
    made.write_truth()
    designs = [design_pid(1.13e-4, LATENCY_s, one, PERIOD_s) for one in bandwidths_Hz]
    run = {
        "winch": "winch-mpp0923d", "motor": "MPP0923D", "date": "2026-01-02T03:04:05+00:00",
        "drive": {"name": "a <drive> & more", "vendor_id": 1, "product_code": 2},
        "encoder_counts_per_turn": COUNTS, "rated_torque_Nm": 3.0, "inertia_kg_m2": 1.13e-4,
        "pid": [dataclasses.asdict(design) for design in designs], "bandwidth_Hz": 8.0,
        "bandwidths_Hz": list(bandwidths_Hz), "latency_s": LATENCY_s,
        "bus": {"url": "simbus:x", "period_s": PERIOD_s, "cycles": 1000, "wall_s": 0.5,
                "missed": 0, "overruns": 0},
    }  # fmt: skip
    thesis = identify_thesis(legs(made.paths.passes("sweep")))
    return Commissioned(made.paths, run, Identified(thesis, harmonic_result()))
