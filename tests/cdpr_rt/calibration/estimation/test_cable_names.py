"""What a cable is called in texts of a calibration."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cdpr_profiles import load_robot
from cdpr_profiles.reading.places import SHIPPED
from cdpr_rt.calibration.estimation.faults import without_slack
from cdpr_rt.calibration.estimation.parameters import CableGeometry
from tests.cdpr_rt.calibration.made_up import made_up, measured

SPATIAL = (SHIPPED / "robots" / "spatial-8.toml").read_text()


def named(folder: Path) -> Path:
    path = folder / "named.toml"
    path.write_text(SPATIAL.replace("[[axes]]", '[[axes]]\nname = "c1"', 1))
    return path


def test_a_cable_is_called_as_its_axis_is_or_by_its_number(tmp_path: Path) -> None:
    geometry = CableGeometry.of(load_robot(str(named(tmp_path))))
    assert geometry.names()[0] == "c1 exit point x"
    assert geometry.names()[len(geometry.rows)] == "cable 2 exit point x"
    assert geometry.cables_text(1, (0, 2)) == "cable 2 (or c1, cable 3)"


def test_a_slack_cable_is_told_with_the_name(tmp_path: Path) -> None:
    what = made_up(str(named(tmp_path)), 20, 3, noise_m=2e-4)
    seen = measured(what, 1e-3, 2e-3, 4)
    seen.tension_N[4, 0] = 0.5
    slack_N = np.full(what.file.n, 1.0)
    assert without_slack(what.file, seen, slack_N)[1][0].text.startswith("c1 was slack at pose 5")
