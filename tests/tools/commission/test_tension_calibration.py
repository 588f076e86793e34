"""Calibration by tension rejects invalid masses, recordings and tensions."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cdpr_profiles import load_winch
from cdpr_rt.errors import InvalidRequestError, RawLogError
from cdpr_rt.identification.rawlog import RawLogWriter
from cdpr_tools.commission.tension_calibration import (
    check_masses,
    mass_points,
    plan_anchor,
    recorded_winch,
)


@pytest.mark.parametrize(
    "masses", [(2.0, 5.0), (2.0, 5.0, float("nan")), (2.0, 2.0, 5.0), (-1.0, 2.0, 5.0), (4, 5, 6)]
)
def test_masses_that_do_not_determine_the_gain_are_rejected(masses: tuple[float, ...]) -> None:
    with pytest.raises(InvalidRequestError, match="--masses: "):
        check_masses(load_winch("winch-mpp0923d"), masses, 9.81)


def test_a_recording_of_a_different_kind_is_rejected(tmp_path: Path) -> None:
    path = tmp_path / "raw" / "mass-2kg.raw"
    log = RawLogWriter(path, ["time_s"], {"identity": {"winch": "w", "motor": "m", "serial": "x"}})
    log.write(np.zeros((3, 1)))
    log.close()
    with pytest.raises(RawLogError, match="not a recording of a hoist"):
        mass_points([path])
    with pytest.raises(RawLogError, match="does not name its winch"):
        recorded_winch(tmp_path)
    (path.parent / "mass-2kg.raw").unlink()
    with pytest.raises(InvalidRequestError, match="contains no recordings of a calibration"):
        recorded_winch(tmp_path)


@pytest.mark.parametrize("tensions_N", [(0.0, 80.0), (80.0, 10.0), (10.0, 1e4)])
def test_tensions_beyond_the_motors_torque_are_rejected(tensions_N: tuple[float, float]) -> None:
    with pytest.raises(InvalidRequestError, match="must be above 0 and below the second"):
        plan_anchor(load_winch("winch-mpp0923d"), *tensions_N, 5e-3, 0.5)
