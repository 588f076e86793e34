"""The axes of a robot as programs need them: bounds, gains, compensation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cdpr_profiles import RobotAxis
from cdpr_rt.arrays import FloatArray
from cdpr_rt.control.compensation import AxisCompensation
from cdpr_rt.control.pid import PidGains
from cdpr_rt.control.tuning import PidDesign, standstill_gains, stiffest_pid, sweep_gain
from cdpr_rt.core.supervisor import Limits

BANDWIDTHS_Hz = (30.0, 25.0, 20.0, 15.0, 12.0, 10.0, 8.0, 6.0, 5.0, 4.0, 3.0, 2.0, 1.0, 0.5)
"""Bandwidths tried for the position loops, the highest first."""
CABLE_ACCELERATION_M_S2 = 1.0
"""Acceleration of cable set-points."""
SETPOINT_SPEED_SHARE = 0.8
"""Highest set-point speed, as a share of the supervisor's limit, because axes overshoot."""
FOLLOWING_SHARE = 0.2
"""Rate of the faster integral of an axis that follows a set-point, as a share of kp/kd, the corner
frequency of its loop."""


@dataclass(frozen=True)
class AxesModel:
    """Bounds and gains of a robot's axes as arrays (n,) on the motor side, and common values."""

    period_s: float
    torque_Nm: FloatArray
    """The highest torque that the controllers may command."""
    speed_rad_s: FloatArray
    """The highest speed of a set-point."""
    acceleration_rad_s2: FloatArray
    """The highest acceleration of a set-point."""
    cable_m_per_rad: FloatArray
    """Cable paid out per radian, with its sign."""
    gains: tuple[PidGains, ...]
    """Gains of the position loops, one per axis."""
    sweep_gain_Nm_rad: FloatArray
    """Gain of the cogging sweep's proportional controller, (n,)."""
    compensation: tuple[AxisCompensation | None, ...] = ()
    """Cogging and friction of each motor, None if unknown; empty if all are unknown."""

    @property
    def n(self) -> int:
        """Number of axes."""
        return len(self.gains)


def position_loop(inertia_kg_m2: float, latency_s: float, period_s: float) -> PidDesign:
    """Return the position loop of a rotor without load; raises TuningError.

    The margins are those of an axis at rest. While the axis follows a set-point, the integral is
    faster, see `FOLLOWING_SHARE`.
    """
    design = stiffest_pid(inertia_kg_m2, latency_s, BANDWIDTHS_Hz, period_s)
    firm = standstill_gains(design, period_s)
    gains = firm.gains
    following = FOLLOWING_SHARE * gains.proportional_Nm_rad**2 / gains.derivative_Nms_rad
    return replace(firm, gains=replace(gains, following_Nm_rad_s=following))


def model_of(
    axes: Sequence[RobotAxis],
    period_s: float,
    latency_s: Sequence[float],
    limits: Limits,
    compensation: Sequence[AxisCompensation | None] = (),
) -> AxesModel:
    """Return the model of axes whose loops are as stiff as the latency of each axis allows.

    `latency_s` (n,) is the time from the sampling of an angle to the middle of the cycle in which
    the resulting torque acts. `compensation` (n,), or empty, is the known cogging and friction of
    each motor. Loops are designed for rotors without load. Raises TuningError if a latency is too
    long for any loop.
    """
    cable = np.array([axis.winch.cable_m_per_motor_rad for axis in axes])
    inertia = [axis.winch.motor.rotor_inertia_kg_m2 for axis in axes]
    pairs = list(zip(inertia, latency_s, strict=True))
    designs = {
        (J, latency): position_loop(J, latency, period_s).gains
        for J, latency in dict.fromkeys(pairs)
    }
    return AxesModel(
        period_s=period_s,
        torque_Nm=np.broadcast_to(limits.torque_Nm, cable.shape).astype(float),
        speed_rad_s=SETPOINT_SPEED_SHARE * np.broadcast_to(limits.speed_rad_s, cable.shape),
        acceleration_rad_s2=CABLE_ACCELERATION_M_S2 / np.abs(cable),
        cable_m_per_rad=cable,
        gains=tuple(designs[pair] for pair in pairs),
        sweep_gain_Nm_rad=np.array([sweep_gain(J, latency) for J, latency in pairs]),
        compensation=tuple(compensation),
    )
