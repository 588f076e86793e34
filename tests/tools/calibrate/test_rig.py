"""The procedure of calibration on a simulated robot over its bus, with a scanner beside it."""

from __future__ import annotations

from itertools import islice
from pathlib import Path

import numpy as np

from cdpr_rt.procedures.calibration.measure_poses import Measured, measure_poses, read_pose
from cdpr_tools.calibrate.rig import simulated_rig

_PLANT = """
[geometry]
exit_errors_m = [[0.006, 0.0], [0.0, -0.006], [0.0, 0.005]]
[scanner]
position_sigma_m = 0.0005
"""


class Notes:
    def note(self, text: str) -> None:
        raise AssertionError(text)


def test_home_and_poses_are_read_and_measured(tmp_path: Path) -> None:
    plant = tmp_path / "plant.toml"
    plant.write_text(_PLANT)
    told: list[float] = []
    with simulated_rig("planar-3", plant=plant, scanner=True, advance=told.append) as operator:
        home = read_pose(operator, operator.tighten())
        measured = Measured()
        measure_poses(operator, islice(operator.random_places(3), 6), 2, measured, Notes())
    assert len(measured.readings) == 2 and told == sorted(told) and told[-1] > 2.0
    for reading in (home, *measured.readings):
        assert reading.position_m is not None
        off = np.array(reading.position_m[:2]) - np.array(reading.target[:2])
        # the exit points are some millimetres from where the file has them
        assert 1e-5 < float(np.linalg.norm(off)) < 0.03
        assert reading.position_std_m is not None and 1e-4 < reading.position_std_m < 3e-4
        assert min(reading.tension_N) > 5.0 and min(reading.length_m) > 0.5
