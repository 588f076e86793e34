"""Baseline: one cycle of a platform's control in plain NumPy and SciPy, a formula a line."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.linalg import null_space
from scipy.optimize import nnls
from scipy.spatial.transform import Rotation

from cdpr_profiles import RobotAxis
from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.errors import GeometryError
from cdpr_rt.robots.platform.design.loop_gains import LoopGains, latency_s
from cdpr_rt.robots.platform_model import PlatformModel
from cdpr_rt.robots.rigid_body import in_space, inertia_kg_m2

_G_m_s2 = 9.80665
_OBSERVER_rad_s, _RATIO = 2.0 * math.pi * 400.0, 0.55
_REGULATOR, _MOST, _BREAKING, _STUCK_m_s, _DEAD_m, _CALM_S = 0.25, 0.3, 20.0, 0.002, 6e-5, 0.02
_POLE_rad_s, _USUAL, _WRENCH, _NOISE, _ODD = 19.0, (0.04, 0.03, 0.03), 0.25, 0.09, 0.08
_FAST, _SLOW, _LIFT_S, _SHAPING_S, _STRETCHING = 0.85, 0.5, 0.05, 0.06, 0.2


class BaselineCableControl:
    """What `CableControl.update` computes, of motors that are not known, where tensions exist.

    For eyes as exit points, and the least tensions.
    """

    def __init__(
        self,
        model: PlatformModel,
        axes: Sequence[RobotAxis],
        torque_Nm: FloatArray,
        period_s: float,
        gains: LoopGains,
    ) -> None:
        """Take over the gains; raises GeometryError for what this does not compute."""
        platform = model.platform
        if any(platform.pulley_radius_m) or platform.tension_distribution != "minimum-deviation":
            raise GeometryError("pulleys, or tensions other than minimum-deviation; allowed: none")
        if not gains.follows_pose:
            raise GeometryError("tensions of the set-point; allowed: those that follow the pose")
        self.model, self.gains, self.T, self.limit = model, gains, period_s, torque_Nm
        self.a = np.array([in_space(point) for point in platform.exit_points_m])
        self.b = np.array([in_space(point) for point in platform.anchor_points_m])
        self.c = np.array([axis.winch.cable_m_per_motor_rad for axis in axes])
        self.rotor = np.array([axis.winch.motor.rotor_inertia_kg_m2 for axis in axes])
        EA = np.array([axis.winch.cable.stiffness_N for axis in axes])
        weights = np.array([axis.winch.cable.weight_per_length_N_m for axis in axes])
        self.compliance = 1.0 / EA if platform.cable_model != "rigid" else np.zeros(len(axes))
        self.weight = weights if platform.cable_model == "catenary" else np.zeros(len(axes))
        self.chosen, self.scale = list(model.kinematics.directions), model.wrench_scale
        self.turns_freely = model.kinematics.directions == (0, 1) and bool(
            np.ptp(self.b, axis=0).any()
        )
        self.low, self.high = model.low_N + model.reserve_N, model.high_N - model.reserve_N
        self.span = float((model.high_N - model.low_N).min())
        self.p, self.Q = model.home_pose.p.copy(), model.home_pose.Q.copy()
        n, d = len(axes), model.size
        self.theta, self.omega, self.lagging, self.calm = np.zeros((4, n))
        self.at_zero, self.stretched_by, self.slow = np.zeros(n), self.low.copy(), self.low.copy()
        self.stretch = np.ones(n)
        self.integral, self.moving_integral, self.calm_twist = np.zeros((3, d))
        self.awake, self.share = 0.0, 1.0
        self.learning = _Learning(axes, self.scale, model.reserve_N, period_s)
        self.position, self.velocity, self.acceleration = (
            model.home.copy(),
            np.zeros(d),
            np.zeros(d),
        )

    def begin(self, length_m: FloatArray) -> None:
        """Stand still with cables of these lengths without tension, motors at 0."""
        self.at_zero = length_m
        for _ in range(60):
            self._locate(np.zeros(len(self.c)))
        turned = Rotation.from_matrix(self.Q @ self.model.home_pose.Q.T).as_rotvec()
        self.position = np.concatenate([self.p, turned])[self.chosen]
        standing = np.array([self.position, self.velocity, self.acceleration])
        self.past = [standing] * max(1, round(_SHAPING_S / self.T))

    def update(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Write torques and the axes' set-points, (n,) each."""
        J, twist = self._locate(feedback.position_rad)
        self.past = [*self.past[1:], np.array([self.position, self.velocity, self.acceleration])]
        position, Q, v_d, a_d = self._follow(np.mean(self.past, axis=0))
        rho, J_d = self._cables(position, Q)
        setpoint.position_rad[:] = (rho / self.stretch - self.at_zero) / self.c
        setpoint.velocity_rad_s[:] = J_d @ v_d / self.c
        setpoint.acceleration_rad_s2[:] = J_d @ a_d / self.c
        error = np.concatenate([position - self.p, Rotation.from_matrix(Q @ self.Q.T).as_rotvec()])
        M, known = self._body(v_d, a_d)
        force = self._force(J, M[np.ix_(self.chosen, self.chosen)], error, v_d, twist)
        late = self.theta + latency_s(self.T) * self.omega
        learnt = self.learning.update(
            J, self.mass, v_d[self.chosen] - twist, force, late, setpoint.velocity_rad_s
        )
        hanging, rise = self._hang()
        t, carried, N = self._split(-J.T, (known + hanging)[self.chosen], force)
        self.stretched_by = self.stretched_by + _STRETCHING * (carried - self.stretched_by)
        pull = t + rise + self.gains.null_damping_N_s_m * N @ (N.T @ (self.c * self.omega))
        effort = self.rotor * setpoint.acceleration_rad_s2 - self.c * pull
        torque_Nm[:] = np.clip(effort + learnt, -self.limit, self.limit)

    def _cables(self, p: FloatArray, Q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return lengths (n,) and J (n, 6), eqs. (3.2), (3.10)."""
        r = self.b @ Q.T
        way = p + r - self.a
        rho = np.linalg.norm(way, axis=1)
        u = way / rho[:, None]
        return np.asarray(rho), np.hstack([u, np.cross(r, u)])

    def _hang(self) -> tuple[FloatArray, FloatArray]:
        """Return the wrench (6,) of the cables' weight, and by what tensions rise to exits (n,)."""
        if not self.weight.any():
            return np.zeros(6), np.zeros(len(self.a))
        r = self.b @ self.Q.T
        way = self.p + r - self.a
        w = np.zeros_like(way)
        w[:, self.model.positions - 1] = -self.weight
        half = 0.5 * np.linalg.norm(way, axis=1)[:, None] * w
        wrench = np.concatenate([half, np.cross(r, half)], axis=1).sum(axis=0)
        return wrench, 0.5 * (way * w).sum(axis=1)

    def _locate(self, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Observe the motors, find the pose by Gauss-Newton; return J (n, d) and the twist (d,)."""
        T, gains = self.T, self.gains
        z, w = math.exp(-_OBSERVER_rad_s * T), 1.0 - math.exp(-gains.smoother_rad_s * T)
        predicted = self.theta + T * self.omega
        error = theta - predicted
        self.theta = predicted + (1.0 - z**2) * error
        self.omega = self.omega + (1.0 - z) ** 2 / T * error
        self.lagging = self.lagging + w * (self.omega - self.lagging)
        self.calm = self.calm + w * (self.lagging - self.calm)
        measured = (self.at_zero + self.c * self.theta) * self.stretch
        if self.turns_freely:
            self._turn()
        for _ in range(10):
            rho, J = self._cables(self.p, self.Q)
            step = np.zeros(6)
            step[self.chosen] = np.linalg.lstsq(J[:, self.chosen], measured - rho, rcond=None)[0]
            self.p = self.p + step[:3]
            self.Q = Rotation.from_rotvec(step[3:]).as_matrix() @ self.Q
            if np.linalg.norm(step) < 1e-9:
                break
        rho, J = self._cables(self.p, self.Q)
        height = rho * J[:, self.model.positions - 1]
        self.stretch = rho / self._unstretched(np.sqrt(rho**2 - height**2), height)
        J = J[:, self.chosen]
        rate = self.c * (self.omega + gains.smooth * (self.calm - self.omega))
        return J, np.asarray(np.linalg.lstsq(J, rate, rcond=None)[0], float)

    def _unstretched(self, across: FloatArray, height: FloatArray) -> FloatArray:
        """Return the cables' lengths without tension (n,): elastic catenaries, (3.81) to (3.84)."""
        w, c = self.weight, self.compliance
        t = self.stretched_by + 0.5 * w * height
        if not w.any():
            return np.hypot(across, height) / (1.0 + t * c)
        beside = above = c + 1.0 / t
        for _ in range(4):
            h, v = across / beside, height / above
            middle, square = t**2 - w * v, h**2 + v**2
            length = np.sqrt(2.0 * square / (middle + np.sqrt(middle**2 - w**2 * square)))
            H, V = across / (beside * length), height / (above * length) + 0.5 * w * length
            ends = t + np.hypot(H, V - w * length)
            x = w * length / ends
            beside, above = c + 2.0 / ends * np.arctanh(x) / x, c + 2.0 / ends
        return np.asarray(length)

    def _turn(self) -> None:
        """Turn about z by one Newton step to where the tensions have no moment."""
        r = self.b @ self.Q.T
        way = self.a - self.p - r
        rho = np.linalg.norm(way, axis=1)
        w = way / rho[:, None]
        across = r[:, 0] * w[:, 1] - r[:, 1] * w[:, 0]
        along = -r[:, 1] * w[:, 0] + r[:, 0] * w[:, 1]
        arms = (r * w).sum(axis=1) + ((r**2).sum(axis=1) - along * across) / rho
        stiffness = self.stretched_by @ arms
        if stiffness > 0.0:
            angle = np.clip(self.stretched_by @ across / stiffness, -0.02, 0.02)
            self.Q = Rotation.from_rotvec([0.0, 0.0, angle]).as_matrix() @ self.Q

    def _follow(self, q: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return position, rotation, twist and its derivative of a set-point (3, d)."""
        home = self.model.home_pose
        x = np.zeros((3, 6))
        x[0, :3] = home.p
        x[:, self.chosen] = q
        phi, rate, slope = x[:, 3:]
        Q = self.Q if self.chosen[-1] < 3 else Rotation.from_rotvec(phi).as_matrix() @ home.Q
        spin = _left_jacobian(phi) @ rate
        after = _left_jacobian(phi + self.T * rate) @ rate
        twice = _left_jacobian(phi) @ slope + (after - spin) / self.T
        return x[0, :3], Q, np.concatenate([x[1, :3], spin]), np.concatenate([x[2, :3], twice])

    def _body(self, v: FloatArray, a: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the mass matrix (6, 6), and the wrench (6,) of weight and inertia."""
        platform = self.model.platform
        m, r = platform.mass_kg, self.Q @ in_space(platform.centre_of_mass_m)
        inertia = self.Q @ inertia_kg_m2(platform) @ self.Q.T
        R, omega = _cross_matrix(r), v[3:]
        M = np.block([[m * np.eye(3), -m * R], [m * R, inertia - m * R @ R]])
        g = np.zeros(3)
        g[self.model.positions - 1] = -_G_m_s2
        f = m * g - m * np.cross(omega, np.cross(omega, r))
        moment = np.cross(r, f) - np.cross(omega, inertia @ omega)
        return M, np.concatenate([f, moment]) - M @ a

    def _force(
        self, J: FloatArray, M_p: FloatArray, error: FloatArray, v_d: FloatArray, twist: FloatArray
    ) -> FloatArray:
        gains, A = self.gains, J.T @ J
        self.mass = M = M_p + gains.rotor_kg * A
        D = np.linalg.inv(
            np.linalg.inv(2.0 * _RATIO * gains.bandwidth_rad_s * M)
            + np.linalg.inv(gains.damping_N_s_m * A)
        )
        e = error[self.chosen]
        pull = D @ np.linalg.solve(M, D @ e) / (4.0 * _RATIO**2)
        pull = pull / max(1.0, float(np.linalg.norm(pull / self.scale)) / (_REGULATOR * self.span))
        moving = bool(np.abs(v_d[self.chosen]).sum() > 0.0)
        threshold = _DEAD_m * (2.0 - self.awake)
        close = float(np.linalg.norm(self.scale * e)) / threshold
        self.awake = 1.0 if moving else 1.0 / (1.0 + math.exp(-8.0 * (close - 1.0)))
        self.calm_twist = self.calm_twist + self.T / (self.T + _CALM_S) * (twist - self.calm_twist)
        gain = self.awake * gains.integral_1_s * self.T
        if not moving:
            speed = float(np.linalg.norm(self.scale * self.calm_twist))
            gain *= 1.0 + _BREAKING * math.exp(-min((speed / _STUCK_m_s) ** 2, 50.0))
        if moving:
            rubbing = np.abs(J).T @ (self.learning.x[: 3 * len(self.c) : 3] / np.abs(self.c))
            gained = self.integral - self.moving_integral
            self.integral = self.integral - np.clip(gained, -rubbing, rubbing)
        step, most = gain * pull, _MOST * self.span * self.scale
        taken = (self.share >= 1.0) | (step * self.integral < 0.0)
        integral = np.clip(self.integral + step, -most, most)
        self.integral = np.where(taken, integral, self.integral)
        if moving:
            self.moving_integral = self.integral
        return np.asarray(D @ (v_d[self.chosen] - twist) + pull + self.integral)

    def _split(
        self, W: FloatArray, known: FloatArray, force: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return tensions, those that carry what is known alone, and N (n, r)."""
        N, reserve = null_space(W), self.model.reserve_N
        lift = self._project(W, N, known - force, self.low, _SLOW * reserve)
        self.slow = self.slow + self.T / (self.T + _LIFT_S) * (lift - self.slow)
        carried = self._project(W, N, known, self.slow, 0.0)
        t = self._project(W, N, known - force, carried, _FAST * reserve)
        return t, carried, N

    def _project(
        self, W: FloatArray, N: FloatArray, wrench: FloatArray, preferred: FloatArray, wider: float
    ) -> FloatArray:
        """Return the tensions within bounds that carry a wrench nearest to wanted ones.

        As a least distance that non-negative least squares finds: Lawson and Hanson (1974), 23.4.
        """
        nearest = preferred - np.linalg.pinv(W) @ (W @ preferred + wrench)
        inside = np.concatenate([nearest - self.low + wider, self.high + wider - nearest])
        if inside.min() >= 0.0:
            return np.asarray(nearest)
        G = np.vstack([N, -N])
        E = np.vstack([G.T, -inside])
        f = np.zeros(len(E))
        f[-1] = 1.0
        r = E @ nnls(E, f)[0] - f
        return np.asarray(nearest - N @ (r[:-1] / r[-1]))


class _Learning:
    """Friction and cogging of the motors: a Kalman filter over the platform's motion."""

    def __init__(
        self, axes: Sequence[RobotAxis], scale: FloatArray, reserve_N: float, period_s: float
    ) -> None:
        n, d = len(axes), len(scale)
        rated = np.array([axis.winch.motor.rated_torque_Nm for axis in axes])
        self.g = np.array([axis.winch.cable_m_per_motor_rad for axis in axes])
        self.pairs = np.array([axis.winch.motor.pole_pairs for axis in axes])
        force_N = float((rated / np.abs(self.g)).mean())
        self.sigma = np.concatenate([np.outer(rated, _USUAL).ravel(), _WRENCH * force_N * scale])
        self.keep = 1.0 - period_s / np.repeat([600.0, 300.0], [3 * n, d])
        self.noise = _NOISE * force_N * scale
        self.most = np.minimum(_ODD * rated, reserve_N / 3.0 * np.abs(self.g))
        self.settling = round(0.3 / period_s)
        self.share = period_s * _POLE_rad_s / (1.0 + period_s * _POLE_rad_s)
        self.x, self.P = np.zeros(3 * n + d), np.diag(self.sigma**2)
        self.phi, self.u, self.k = np.zeros((n, 3)), np.zeros(n), 0
        self.low = [self.phi, self.u, np.zeros(d), np.zeros(d)]
        self.last = np.zeros((n, d)), np.zeros((d, d)), np.zeros(d), np.zeros(d)

    def update(
        self, J: FloatArray, M: FloatArray, v: FloatArray, F: FloatArray, angle: FloatArray,
        speed: FloatArray,
    ) -> FloatArray:  # fmt: skip
        """Take in the last cycle; return the torques (n,) against what was learnt."""
        self._take(*self.last)
        self.last = J, M, v, F
        w = self.x[: 3 * len(self.g)].reshape(-1, 3)
        turned = self.pairs * angle
        sign = np.clip(speed / 0.1, -1.0, 1.0)
        self.phi = np.column_stack([sign, np.sin(turned), np.cos(turned)])
        size = np.maximum(np.linalg.norm(w[:, 1:], axis=1), self.most)
        wave = (w[:, 1:] * self.phi[:, 1:]).sum(axis=1) * self.most / size
        self.u = 0.95 * w[:, 0] * sign + wave
        return np.asarray(self.u)

    def _take(self, J: FloatArray, M: FloatArray, v: FloatArray, F: FloatArray) -> None:
        new = [self.phi, self.u, F, v]
        self.settling = max(self.settling - 1, 0)
        if self.settling:
            self.low = [np.zeros_like(self.phi), np.zeros_like(self.u), np.zeros_like(F), v]
        else:
            self.low = [a + self.share * (b - a) for a, b in zip(self.low, new, strict=True)]
        phi, u, force, calm = self.low
        n, d, k = len(u), len(F), self.k
        moving = not self.settling and bool((np.abs(phi[:, 0]) > 0.5).any())
        keep = np.where(moving | (np.arange(len(self.x)) >= 3 * n), self.keep, 1.0)
        self.x, self.P = keep * self.x, np.outer(keep, keep) * self.P
        self.P += np.diag((1.0 - keep**2) * self.sigma**2)
        if moving:
            lever = J[:, k] / self.g
            h = np.concatenate([(lever[:, None] * phi).ravel(), np.eye(d)[k]])
            S = h @ self.P @ h + self.noise[k] ** 2
            off = force[k] + _POLE_rad_s * M[k] @ (v - calm) + lever @ u - h @ self.x
            if off**2 < 9.0 * S:
                gain = self.P @ h / S
                self.x, self.P = self.x + gain * off, self.P - np.outer(gain, gain) * S
            w = self.x[: 3 * n].reshape(n, 3)
            w[:, 0] = np.clip(w[:, 0], 0.0, self.most)
            w[:, 1:] = np.clip(w[:, 1:], -self.most[:, None], self.most[:, None])
            self.k = (k + 1) % d


def _cross_matrix(x: FloatArray) -> FloatArray:
    return np.array([[0.0, -x[2], x[1]], [x[2], 0.0, -x[0]], [-x[1], x[0], 0.0]])


def _left_jacobian(phi: FloatArray) -> FloatArray:
    """Return the angular velocity by the rotation vector's derivative, (3, 3)."""
    angle, X = float(np.linalg.norm(phi)), _cross_matrix(phi)
    if angle < 1e-4:
        return np.asarray(np.eye(3) + X / 2.0 + X @ X / 6.0)
    one, two = (1.0 - math.cos(angle)) / angle**2, (angle - math.sin(angle)) / angle**3
    return np.asarray(np.eye(3) + one * X + two * X @ X)
