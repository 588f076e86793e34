"""What encoders tell of cables that weigh something, beside elastic catenaries."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cdpr_profiles import load_robot
from cdpr_rt.calibration.estimation.parameters import CableGeometry
from cdpr_rt.calibration.estimation.residuals import lengths_told
from tests.heavy_cables import cables_on

WEIGHT_N_m = 2.0


def test_lengths_belong_to_the_tensions_that_winches_tell() -> None:
    robot = load_robot("suspended-8")
    assert robot.platform is not None
    cable = robot.axes[0].winch.cable.model_copy(update={"weight_per_length_N_m": WEIGHT_N_m})
    axes = [replace(axis, winch=replace(axis.winch, cable=cable)) for axis in robot.axes]
    platform = replace(robot.platform, cable_weights_N_m=(WEIGHT_N_m,) * len(axes))
    geometry = CableGeometry.of(replace(robot, platform=platform, axes=tuple(axes)))
    winch_N = np.linspace(180.0, 260.0, len(axes))
    for place_m in ((0.0, 0.0, 0.75), (2.0, -1.0, 2.0)):
        poses = np.vstack([place_m, np.eye(3)])[None]
        true_m, _ = cables_on(platform, place_m, [cable.stiffness_N] * len(axes), winch_N)
        told_m = lengths_told(geometry, poses, winch_N[None])[0]
        np.testing.assert_allclose(told_m, true_m, atol=1e-5)
