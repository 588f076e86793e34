"""Parameters of the platform controller, from the robot's file."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cdpr_profiles import RobotAxis
from cdpr_rt.arrays import FloatArray
from cdpr_rt.robots.kinematics import pose_tracking as tracking
from cdpr_rt.robots.platform import loop_kernel as loop
from cdpr_rt.robots.platform.cell_check import CellCheck, balance_std_N
from cdpr_rt.robots.platform.design.loop_gains import DAMPING_RATIO, LoopGains, OBSERVER_rad_s
from cdpr_rt.robots.platform.oscillation import LEAST_COUNTS, RESERVE_SHARES, Oscillation
from cdpr_rt.robots.platform_model import PlatformModel

_REGULATOR_SHARE = 0.25
_INTEGRAL_SHARE = 0.3
_DEADBAND_m = 6e-5
_STICTION_GAIN = 20.0
_STICTION_m_s = 0.002
_SPATIAL, _YAW = 3, 5


def motor_rows(model: PlatformModel, axes: Sequence[RobotAxis]) -> FloatArray:
    """Return what of the motors and cables does not change, (MOTOR_ROWS, n); the rest is 0."""
    platform = model.platform
    rows = np.zeros((tracking.MOTOR_ROWS, len(axes)))
    rows[tracking.M_PER_RAD] = [axis.winch.cable_m_per_motor_rad for axis in axes]
    rows[tracking.INERTIA] = [axis.winch.motor.rotor_inertia_kg_m2 for axis in axes]
    if platform.cable_model != "rigid":
        rows[tracking.COMPLIANCE] = [1.0 / axis.winch.cable.stiffness_N for axis in axes]
    rows[tracking.WEIGHT] = platform.cable_weights_N_m
    rows[tracking.STRETCH] = 1.0
    return rows


def tracking_filters(gains: LoopGains, period_s: float) -> FloatArray:
    """Return the settings of the filters that find the platform's pose, (FILTERS,)."""
    row = np.zeros(tracking.FILTERS)
    row[tracking.PERIOD], row[tracking.OBSERVER] = period_s, OBSERVER_rad_s
    row[tracking.SMOOTHER], row[tracking.LOWPASS_SHARE] = gains.smoother_rad_s, gains.smooth
    return row


def loop_settings(gains: LoopGains, span_N: float, period_s: float) -> FloatArray:
    """Return the settings of the loop's kernels for tensions of this span, (SETTINGS,)."""
    row = np.zeros(loop.SETTINGS)
    row[loop.PERIOD], row[loop.BANDWIDTH] = period_s, gains.bandwidth_rad_s
    row[loop.DAMPING], row[loop.RATIO] = gains.damping_N_s_m, DAMPING_RATIO
    row[loop.INTEGRAL], row[loop.NULL_DAMPING] = gains.integral_1_s, gains.null_damping_N_s_m
    row[loop.ROTOR] = gains.rotor_kg
    row[loop.REGULATOR_N], row[loop.MOST_N] = _REGULATOR_SHARE * span_N, _INTEGRAL_SHARE * span_N
    row[loop.STICTION_GAIN], row[loop.STICTION_SPEED], row[loop.DEADBAND] = (
        _STICTION_GAIN,
        _STICTION_m_s,
        _DEADBAND_m,
    )
    return row


def slides_on_stand(model: PlatformModel) -> FloatArray:
    """Return by how much cables become longer where the platform slides on its stand, (n, k).

    Along the horizontal directions, and in space about the vertical axis where that is controlled,
    in m for each m at the anchor points.
    """
    horizontal = list(range(model.positions - 1))
    if model.positions == _SPATIAL:
        horizontal += [i for i, k in enumerate(model.kinematics.directions) if k == _YAW]
    J = -model.kinematics.wrench_matrix(model.home_pose).T
    return np.asarray((J / model.wrench_scale)[:, horizontal])


def oscillation(
    model: PlatformModel,
    axes: Sequence[RobotAxis],
    motors: FloatArray,
    count_rad: FloatArray,
    velocity: FloatArray,
    period_s: float,
) -> Oscillation:
    """Return what tells that the loop swings the winches of these `motors`, rows as above.

    `count_rad` (n,) is what their encoders tell apart, `velocity` (d,) the set-point's.
    """
    m_per_rad, theta_rad = motors[tracking.M_PER_RAD], motors[tracking.THETA]
    stiffness_N_m = [a.winch.cable.stiffness_N for a in axes] / model.kinematics.lengths(
        model.home_pose
    )
    threshold_m = np.maximum(
        np.outer(RESERVE_SHARES, model.reserve_N / stiffness_N_m),
        LEAST_COUNTS * count_rad * np.abs(m_per_rad),
    )
    names = [axis.name for axis in axes]
    return Oscillation(names, threshold_m, m_per_rad, theta_rad, velocity, period_s)


def cell_check(model: PlatformModel, axes: Sequence[RobotAxis], period_s: float) -> CellCheck:
    """Return the check of the load cells of these axes, one for each cable."""
    rated_N = np.array(
        [a.winch.motor.rated_torque_Nm / abs(a.winch.cable_m_per_motor_rad) for a in axes]
    )
    weight_N = float(np.abs(model.weight()[: model.positions]).max())
    std_N = balance_std_N(weight_N, model.positions - 1, model.wrench_scale)
    return CellCheck([axis.name for axis in axes], rated_N, std_N, model.wrench_scale, period_s)
