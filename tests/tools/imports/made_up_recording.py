"""CSV files as other programs record them: irregular, low-passed, in their own units."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from cdpr_rt.identification.torque_lag import with_lag
from tests.cdpr_rt.identification.bench import Bench, TruePlant

WINCH = "winch-mpp0923d"
KT_PEAK = 0.561 / math.sqrt(2.0)
HUNTING = TruePlant(
    terms=((4, 0.04, 17.0), (24, 0.03, 40.0), (28, 0.012, 70.0), (72, 0.01, 5.0)),
    coulomb=0.05,
    breakaway=0.12,
    kt_error=0.0,
    seed=11,
)
"""Sticks and slips all the way: friction at standstill is 2.4 times that of sliding."""
UNEVEN = TruePlant(
    terms=((2, 0.03, 17.0), (6, 0.05, 40.0), (12, 0.03, 70.0), (18, 0.01, 5.0)),
    coulomb=0.08,
    breakaway=0.10,
    asymmetry=1.0,
    kt_error=0.0,
    seed=12,
)
"""Six slots; friction is three times larger forward than backward."""


def turn(
    bench: Bench, path: Path, speed_deg_s: float, *, turns: float = 1.03, kp: float = 0.6,
    rate_Hz: float = 400.0, lag_s: float = 0.1, gaps_s: Sequence[float] = (),
) -> Path:  # fmt: skip
    """Turn a motor under a soft controller and write a CSV: ms, degrees, amperes (peak)."""
    run, rec = bench.ramp(speed_deg_s, turns, ramp_s=0.2, kp=kp)
    rng = np.random.default_rng(3)
    time = np.cumsum(rng.uniform(0.5, 1.5, int(run.time_s.size * rate_Hz * 1e-3)) / rate_Hz)
    time = time[time < run.time_s[-1] - run.time_s[0]]
    for gap in gaps_s:
        time = time[(time < gap) | (time > gap + 0.1)]
    since = run.time_s - run.time_s[0]
    angle = np.interp(time, since, run.angle_rad)
    current = np.interp(time, since, with_lag(since, rec[:, 7], lag_s)) / KT_PEAK
    lines = ["# made up", "t;phi;iq"]
    lines += [
        f"{1e3 * t:.3f};{math.degrees(a):.4f};{i:.4f}"
        for t, a, i in zip(time, angle, current, strict=True)
    ]
    path.write_text("\n".join(lines) + "\n")
    return path


def mapping(folder: Path, *, lag: str = "0.1", sign: int = 1, **changes: str) -> Path:
    """Write the mapping of these files; `changes` replaces whole columns."""
    columns = {
        "time": 'time = { name = "t", unit = "ms" }',
        "angle": f'angle = {{ name = "phi", unit = "deg", sign = {sign} }}',
        "torque": f'torque = {{ name = "iq", unit = "A_peak", sign = {sign} }}',
        **changes,
    }
    path = folder / "map.toml"
    first = f"torque_lag_s = {lag}\n" if lag else ""
    path.write_text(first + "[columns]\n" + "\n".join(columns.values()) + "\n")
    return path
