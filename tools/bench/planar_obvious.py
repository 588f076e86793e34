"""One cycle of the planar robot's control as one writes it first: NumPy, a formula a line."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from cdpr_rt.exchange import AxisFeedback, FloatArray, Setpoint
from cdpr_rt.robots.planar_control import PlanarControl
from profiles import RobotAxis
from profiles.platform import Platform

_G_m_s2 = 9.80665
_FAST, _SLOW = 0.85, 0.5


class ObviousPlanarControl:
    """What `PlanarControl.update` computes, without compensation, for the same set-points."""

    def __init__(
        self, platform: Platform, axes: Sequence[RobotAxis], control: PlanarControl
    ) -> None:
        """Take over the settings and the present state of `control`, whose platform stands."""
        self.s = control.settings
        self.a = np.array(platform.exit_points_m)
        self.b = np.array(platform.anchor_points_m)
        self.c = np.array([axis.winch.cable_m_per_motor_rad for axis in axes])
        self.EA = np.array([axis.winch.cable.stiffness_N for axis in axes])
        self.low, self.high = control.tensions.low, control.tensions.high
        self.limit = control.torque_Nm
        self.theta = (control.free_lengths_m - control.free_lengths_at_zero_m) / self.c
        self.at_zero = control.free_lengths_at_zero_m.copy()
        self.omega, self.lagging, self.calm = np.zeros(3), np.zeros(3), np.zeros(3)
        self.p, self.angle = control.estimated_m.copy(), control.angle_rad
        self.stretched_by = control.stretching_N.copy()
        self.integral = np.zeros(2)
        self.awake, self.share, self.lift = 1.0, 1.0, 0.0
        standing = np.array([control.position_m, np.zeros(2), np.zeros(2)])
        self.past = [standing] * control.shaping_cycles
        self.position_m, self.velocity_m_s = control.position_m.copy(), np.zeros(2)
        self.acceleration_m_s2 = np.zeros(2)

    def update(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Write torques and the axes' set-points, (3,) each."""
        s = self.s
        self._observe(feedback.position_rad)
        R = self._turn()
        W = self._locate(R)
        swing = self.omega + s["smooth"] * (self.calm - self.omega)
        v = np.asarray(np.linalg.lstsq(-W.T, self.c * swing, rcond=None)[0], float)
        p_d, v_d, a_d = self._shape()
        reach = self.a - p_d - self.b @ R.T
        rho = np.linalg.norm(reach, axis=1)
        free = rho / (1.0 + self.stretched_by / self.EA)
        setpoint.position_rad[:] = (free - self.at_zero) / self.c
        setpoint.velocity_rad_s[:] = -(reach @ v_d) / (rho * self.c)
        setpoint.acceleration_rad_s2[:] = -(reach @ a_d) / (rho * self.c)
        force = self._force(p_d - self.p, v_d, v)
        weight = np.array([0.0, -s["mass"] * _G_m_s2])
        t, carried, u = self._distribute(W, weight - s["mass"] * a_d, force)
        self.stretched_by += 0.2 * (carried - self.stretched_by)
        pull = t + s["loose"] * u * (u @ (self.c * self.omega))
        effort = s["inertia"] * setpoint.acceleration_rad_s2 - self.c * pull
        torque_Nm[:] = np.clip(effort, -self.limit, self.limit)

    def _observe(self, theta: FloatArray) -> None:
        T = self.s["period"]
        z, w = math.exp(-self.s["observer"] * T), 1.0 - math.exp(-self.s["smoother"] * T)
        predicted = self.theta + T * self.omega
        error = theta - predicted
        self.theta = predicted + (1.0 - z**2) * error
        self.omega = self.omega + (1.0 - z) ** 2 / T * error
        self.lagging = self.lagging + w * (self.omega - self.lagging)
        self.calm = self.calm + w * (self.lagging - self.calm)

    def _turn(self) -> FloatArray:
        """Turn towards where the tensions have no moment, and return the rotation (2, 2)."""
        r = self.b @ _rotation(self.angle).T
        reach = self.a - self.p - r
        rho = np.linalg.norm(reach, axis=1)
        w = reach / rho[:, None]
        across = r[:, 0] * w[:, 1] - r[:, 1] * w[:, 0]
        along = -r[:, 1] * w[:, 0] + r[:, 0] * w[:, 1]
        moment = self.stretched_by @ across
        stiffness = self.stretched_by @ (
            (r * w).sum(axis=1) + ((r**2).sum(axis=1) - along * across) / rho
        )
        if stiffness > 0.0:
            self.angle += float(np.clip(moment / stiffness, -0.02, 0.02))
        return _rotation(self.angle)

    def _locate(self, R: FloatArray) -> FloatArray:
        """Find the position by Gauss-Newton, eqs. (2.6) to (2.9); return W (2, 3), eq. (2.13)."""
        measured = (self.at_zero + self.c * self.theta) * (1.0 + self.stretched_by / self.EA)
        for _ in range(5):
            reach = self.a - self.p - self.b @ R.T
            rho = np.linalg.norm(reach, axis=1)
            J = -reach / rho[:, None]
            step = -np.linalg.pinv(J) @ (rho - measured)
            self.p = self.p + step
            if np.abs(step).sum() < 1e-9:
                break
        reach = self.a - self.p - self.b @ R.T
        return np.asarray((reach / np.linalg.norm(reach, axis=1)[:, None]).T)

    def _shape(self) -> FloatArray:
        now = np.array([self.position_m, self.velocity_m_s, self.acceleration_m_s2])
        self.past = [*self.past[1:], now]
        return np.asarray(np.mean(self.past, axis=0))

    def _force(self, error: FloatArray, v_d: FloatArray, v: FloatArray) -> FloatArray:
        s = self.s
        wanted = s["stiffness"] * error + s["damping"] * (v_d - v)
        much = float(np.linalg.norm(wanted)) / s["regulator_N"]
        wanted = wanted / max(1.0, much)
        moving = bool(np.abs(v_d).sum() > 0.0)
        threshold = s["dead_m"] * (2.0 - self.awake)
        close = float(np.linalg.norm(error)) / threshold
        self.awake = 1.0 if moving else 1.0 / (1.0 + math.exp(-8.0 * (close - 1.0)))
        gain = self.awake * s["integral"] * s["period"]
        if not moving:
            gain *= 1.0 + s["breaking"] * math.exp(-min(float(v @ v) / s["stuck_m_s"] ** 2, 50.0))
        step = gain * error
        if self.share < 1.0 or much > 1.0:
            step = np.where(step * self.integral < 0.0, step, 0.0)
        self.integral = np.clip(self.integral + step, -s["most_N"], s["most_N"])
        return np.asarray(wanted + self.integral)

    def _distribute(
        self, W: FloatArray, wrench: FloatArray, force: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return tensions, those that carry the wrench alone, and u: eqs. (2.15) to (2.19)."""
        s, reserve = self.s, self.s["reserve_N"]
        u = np.linalg.qr(W.T, mode="complete")[0][:, 2]
        u = u * np.sign(u.sum())
        inverse = np.linalg.pinv(W)
        t0, more = -inverse @ wrench, inverse @ force
        first, last = _stretch(t0, u, self.low, self.high)
        a, b = _stretch(t0 + more, u, self.low - _SLOW * reserve, self.high + _SLOW * reserve)
        wanted = min(max(0.0, a - first), last - first) if a <= b else 0.0
        self.lift = min(self.lift + s["pace"] * (wanted - self.lift), last - first)
        carried = t0 + (first + self.lift) * u
        room = np.where(
            more < 0.0,
            carried - (self.low - _FAST * reserve),
            self.high + _FAST * reserve - carried,
        )
        self.share = min(1.0, float(np.min(room / np.maximum(np.abs(more), 1e-12))))
        return carried + self.share * more, carried, u


def _rotation(angle: float) -> FloatArray:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s], [s, c]])


def _stretch(
    t0: FloatArray, u: FloatArray, low: FloatArray, high: FloatArray
) -> tuple[float, float]:
    ends = np.array([(low - t0) / u, (high - t0) / u])
    return float(ends.min(axis=0).max()), float(ends.max(axis=0).min())
