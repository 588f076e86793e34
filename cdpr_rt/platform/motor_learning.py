"""Learning of motors that were not commissioned, from the motion of their platform."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from cdpr_profiles import RobotAxis
from cdpr_rt.arrays import BoolArray, FloatArray
from cdpr_rt.jit import bound, jit
from cdpr_rt.platform.loop_plant import latency_s

# Kernels that learn the torque losses of the motors from the motion of the platform: dry friction
# of each motor, and cogging with one period per pole pair. This torque does not reach the platform.
# With v = q̇_d - q̇ and M = M_p + m_r A, the platform under the loop's force F and the motors'
# corrections u (n,), all low-passed by L(s) = ω/(s + ω), obeys L F + M ω (v - L v) + Σ J_i/g_i L
# u_i = Σ J_i/g_i L φ_i·w_i + c, φ = (sign θ̇_d, sin pθ, cos pθ). A Kalman filter finds w (n, 3),
# Nm, from one of these d equations a cycle. u is the sum of all added torques, whatever their
# source. c (d,) is a wrench that stays for seconds: a payload, errors of mass and torque constants,
# a hand that pulls. It is far more uncertain than w, so effects that keep their sign when the
# motion reverses count as c, not as friction. w is bounded. The filter's states x (m,), m = 3 n +
# d, are w, row by row, and c. Without information from motion they return to 0: ẋ = -x/T + noise,
# with a stationary standard deviation σ. `filters` (4 n + 2 d,) are φ row by row, u, F and v,
# low-passed.

TERMS = 3
PERIOD, POLE, REVERSAL, LATENCY, NOISE_N, SETTINGS = range(6)
"""Period, s; ω, rad/s; the motor's speed, rad/s, above which its friction has its full sign; delay
of a torque, s; standard deviation of one cycle's equation, N."""
SIGMA, FADING, STATE_ROWS = range(3)
"""Rows of `states` (2, m): σ and T of each."""
_SHARE = 0.95
_DECIDED = 0.5
_SIGMAS = 3.0


@jit
def write_learnt(
    settings: FloatArray,
    pole_pairs: FloatArray,
    most: FloatArray,
    x: FloatArray,
    theta: FloatArray,
    omega: FloatArray,
    terms: FloatArray,
    torque: FloatArray,
    reference: FloatArray,
) -> None:
    """Write φ into `terms` (n, 3), and the torques (n,) that compensate what was learnt.

    `reference` (n,) is the wanted speed of the motors, `most` (3, n) the bounds of friction,
    cogging, and both together. A small part of the friction is not compensated, because with too
    much compensation the platform would run ahead of its set-point.
    """
    for i in range(torque.size):
        angle = pole_pairs[i] * (theta[i] + settings[LATENCY] * omega[i])
        terms[i, 0] = min(max(reference[i] / settings[REVERSAL], -1.0), 1.0)
        terms[i, 1], terms[i, 2] = math.sin(angle), math.cos(angle)
        friction = _SHARE * x[TERMS * i]
        sine, cosine = x[TERMS * i + 1], x[TERMS * i + 2]
        size = math.sqrt(sine * sine + cosine * cosine)
        share = 1.0 if size <= most[1, i] else most[1, i] / size
        both = friction * terms[i, 0] + share * (sine * terms[i, 1] + cosine * terms[i, 2])
        torque[i] = min(max(both, -most[2, i]), most[2, i])


@jit
def learn(
    settings: FloatArray,
    states: FloatArray,
    scale: FloatArray,
    m_per_rad: FloatArray,
    J: FloatArray,
    M: FloatArray,
    v: FloatArray,
    force: FloatArray,
    terms: FloatArray,
    added: FloatArray,
    most: FloatArray,
    filters: FloatArray,
    x: FloatArray,
    P: FloatArray,
    scratch: FloatArray,
    direction: int,
    usable: bool,
) -> int:
    """Process one cycle: update `x` (m,) and their covariance `P` (m, m); return the next
    direction.

    `most` (3, n) bounds friction and cogging. Only the lower half of M (d, d) is used. `usable` is
    whether the force was exerted. Nothing is learnt if it was not, if no motor has to turn, or if
    neither friction nor cogging can explain the deviation. `scratch` (2, m) is overwritten.
    """
    n, d = J.shape
    w = TERMS * n
    usable = _low_pass(settings, terms, added, force, v, filters, usable)
    _fade(settings, states, 0 if usable else w, x, P)
    if not usable:
        return direction
    h, Ph = scratch[0], scratch[1]
    measured = filters[w + n + direction]
    for k in range(d):
        accelerated = settings[POLE] * (v[k] - filters[w + n + d + k])
        measured += M[max(k, direction), min(k, direction)] * accelerated
    h[:] = 0.0
    for i in range(n):
        lever = J[i, direction] / m_per_rad[i]
        measured += lever * filters[w + i]
        for j in range(TERMS):
            h[TERMS * i + j] = lever * filters[TERMS * i + j]
    h[w + direction] = 1.0
    noise = settings[NOISE_N] * scale[direction]
    if _take_in(measured, noise * noise, h, Ph, x, P):
        for i in range(n):
            x[TERMS * i] = min(max(x[TERMS * i], 0.0), most[0, i])
            for j in range(1, TERMS):
                x[TERMS * i + j] = min(max(x[TERMS * i + j], -most[1, i]), most[1, i])
    following: int = (direction + 1) % d
    return following


@jit
def _take_in(
    y: float, S: float, h: FloatArray, Ph: FloatArray, x: FloatArray, P: FloatArray
) -> bool:
    """Correct `x` and `P` by a measurement y = h·x of variance `S`; return False for an outlier.

    `Ph` (m,) is overwritten.
    """
    innovation = y
    for i in range(x.size):
        Ph[i] = 0.0
        for k in range(x.size):
            Ph[i] += P[i, k] * h[k]
        S += h[i] * Ph[i]
        innovation -= h[i] * x[i]
    if not innovation * innovation < _SIGMAS * _SIGMAS * S:
        return False
    for i in range(x.size):
        x[i] += Ph[i] * innovation / S
        for k in range(x.size):
            P[i, k] -= Ph[i] * Ph[k] / S
    return True


@jit
def _low_pass(
    settings: FloatArray,
    terms: FloatArray,
    added: FloatArray,
    force: FloatArray,
    v: FloatArray,
    filters: FloatArray,
    usable: bool,
) -> bool:
    """Update `filters`, or begin again; return whether a motor had to turn."""
    n, d = added.size, v.size
    w = TERMS * n
    if not usable:
        filters[: w + n + d] = 0.0
        for k in range(d):
            filters[w + n + d + k] = v[k]
        return False
    share = settings[PERIOD] * settings[POLE] / (1.0 + settings[PERIOD] * settings[POLE])
    moving = False
    for i in range(n):
        for j in range(TERMS):
            filters[TERMS * i + j] += share * (terms[i, j] - filters[TERMS * i + j])
        filters[w + i] += share * (added[i] - filters[w + i])
        moving = moving or abs(filters[TERMS * i]) > _DECIDED
    for k in range(d):
        filters[w + n + k] += share * (force[k] - filters[w + n + k])
        filters[w + n + d + k] += share * (v[k] - filters[w + n + d + k])
    return moving


@jit
def _fade(
    settings: FloatArray, states: FloatArray, first: int, x: FloatArray, P: FloatArray
) -> None:
    """Let the states from `first` on decay towards 0 for one cycle, and their variances towards
    σ².
    """
    for i in range(first, x.size):
        keep = 1.0 - settings[PERIOD] / states[FADING, i]
        x[i] *= keep
        for k in range(x.size):
            P[i, k] *= keep
            P[k, i] *= keep
        P[i, i] += (1.0 - keep * keep) * states[SIGMA, i] ** 2


POLE_rad_s = 19.0
"""Pole of the low-pass, below the frequency of the platform's swing and above most of its
motion."""
FRICTION_SHARE, COGGING_SHARE = 0.04, 0.03
"""Usual friction and cogging (standard deviation), as shares of the motor's rated torque."""
MOST_SHARE, MOST_RESERVE_SHARE = 0.08, 1.0 / 3.0
"""Bounds of friction and cogging: a share of the rated torque, or a share of the reserve of planned
tensions, as a torque. The smaller of the two applies."""
WRENCH_SHARE, NOISE_SHARE = 0.25, 0.09
"""Usual errors of the platform's wrench, and of one cycle's equation, as shares of the rated
tension."""
REVERSAL_rad_s = 0.1
MOTORS_FADING_S, WRENCH_FADING_S = 600.0, 300.0
"""T of the wrench. It is so long that the wrench changes in a second by less than friction does in
a reversal, 2 % of the cables' rated tension. So a torque that changes sign with the motion is not
attributed to the wrench."""
_UNSURE = 2.0
"""Number of standard deviations by which friction in motion may exceed that found at rest."""
_SETTLING_S = 0.3
"""Nothing is learnt for this time after a change of programs, while torques are handed over."""


class MotorLearning:
    """Friction of n motors and their cogging once per pole pair, from the platform's motion.

    See above. Nothing is learnt about the motors that are `known` (n,).
    """

    def __init__(
        self,
        axes: Sequence[RobotAxis],
        known: BoolArray,
        scale: FloatArray,
        reserve_N: float,
        period_s: float,
    ) -> None:
        """Take the length for a unit of each direction, `scale` (d,), and the tensions' reserve."""
        n, d = len(axes), scale.size
        m = TERMS * n + d
        rated_Nm = np.array([axis.winch.motor.rated_torque_Nm for axis in axes])
        cable = np.array([axis.winch.cable_m_per_motor_rad for axis in axes])
        rated_N = float((rated_Nm / np.abs(cable)).mean())
        self.settings = np.zeros(SETTINGS)
        self.settings[PERIOD], self.settings[POLE] = period_s, POLE_rad_s
        self.settings[REVERSAL] = REVERSAL_rad_s
        self.settings[LATENCY] = latency_s(period_s)
        self.settings[NOISE_N] = NOISE_SHARE * rated_N
        self._states = np.zeros((STATE_ROWS, m))
        shares = np.tile([FRICTION_SHARE, COGGING_SHARE, COGGING_SHARE], n)
        of_motors = np.repeat(np.where(known, 0.0, rated_Nm), TERMS)
        self._states[SIGMA] = [*(shares * of_motors), *(WRENCH_SHARE * rated_N * scale)]
        self._states[FADING] = [MOTORS_FADING_S] * (m - d) + [WRENCH_FADING_S] * d
        self._scale, self._cable = scale, cable
        self._pole_pairs = np.array([float(axis.winch.motor.pole_pairs) for axis in axes])
        self._usual_Nm = np.minimum(
            MOST_SHARE * rated_Nm, MOST_RESERVE_SHARE * reserve_N * np.abs(cable)
        )
        self._largest_Nm = MOST_SHARE * rated_Nm
        self.most_Nm = np.zeros((3, n))
        """Bounds of friction, cogging, and both together of each motor, (3, n)."""
        self.most_Nm[2] = 2.0 * MOST_RESERVE_SHARE * reserve_N * np.abs(cable)
        self._x, self._P = np.zeros(m), np.zeros((m, m))
        self._terms, self._filters = np.zeros((n, TERMS)), np.zeros(4 * n + 2 * d)
        self._direction = 0
        self._settling = self._cycles = round(_SETTLING_S / period_s)
        self.torque_Nm = np.zeros(n)
        """Torques added as compensation, (n,)."""
        self.forget()

    def bind(
        self,
        theta: FloatArray,
        omega: FloatArray,
        J: FloatArray,
        M: FloatArray,
        v: FloatArray,
        force: FloatArray,
        added_Nm: FloatArray,
    ) -> None:
        """Bind the control's arrays: motors (n,), J (n, d), mass (d, d), error of twist, force.

        `added_Nm` (n,) is the sum of all added torques, including the learnt ones.
        """
        self._learn = bound(
            learn, self.settings, self._states, self._scale, self._cable, J, M, v, force,
            self._terms, added_Nm, self.most_Nm, self._filters, self._x, self._P,
            np.zeros((2, self._x.size)), then=(0, True),
        )  # fmt: skip
        self._write = bound(
            write_learnt, self.settings, self._pole_pairs, self.most_Nm, self._x,
            theta, omega, self._terms, self.torque_Nm, then=(np.zeros(len(theta)),),
        )  # fmt: skip

    def learn(self, usable: bool) -> None:
        """Learn from the last cycle; `usable` is whether the force was exerted in it."""
        self._settling = max(self._settling - 1, 0)
        self._direction = self._learn(self._direction, usable and not self._settling)

    def write(self, wanted_rad_s: FloatArray) -> None:
        """Write `torque_Nm` for these wanted motor speeds (n,)."""
        self._write(wanted_rad_s)

    def restart(self) -> None:
        """Begin again after cycles without this control; learnt values stay."""
        self._settling = self._cycles
        self._filters[:] = self._terms[:] = self.torque_Nm[:] = 0.0

    def forget(self) -> None:
        """Discard learnt values, for example after a change of encoder origins."""
        self.restart()
        self.most_Nm[:2] = self._usual_Nm
        self._x[:] = 0.0
        self._P[:] = np.diag(self._states[SIGMA] ** 2)

    def begin_with(self, found: BoolArray, torque_Nm: FloatArray, covariance: FloatArray) -> None:
        """Begin with results at rest, `found` (n,), for motors that have not been learnt yet.

        `torque_Nm` (n, 3) are friction, and sine and cosine of the cogging, with `covariance` (n,
        3, 3). The bound of friction becomes the result plus its uncertainty, limited by the bound
        of both together. At other angles and under other loads, the friction of an almost
        stationary motor is accurate to 25 % at best.
        """
        terms = self._x[: TERMS * found.size].reshape(-1, TERMS)
        found = found & ~terms.any(axis=1)  # learning in motion is more reliable
        friction = torque_Nm[:, 0] + _UNSURE * np.sqrt(covariance[:, 0, 0])
        most = self.most_Nm
        room = np.maximum(np.minimum(friction, self._largest_Nm), self._usual_Nm)
        most[0] = np.where(found, np.minimum(room, most[2]), most[0])
        bounds = most[[0, 1, 1]].T
        for i in np.flatnonzero(found):
            motor = slice(TERMS * i, TERMS * (i + 1))
            self._x[motor] = np.clip(torque_Nm[i], [0.0, *-bounds[i, 1:]], bounds[i])
            self._P[motor, motor] = covariance[i]

    @property
    def learnt_Nm(self) -> FloatArray:
        """Friction and amplitude of the cogging of each motor, (2, n)."""
        return np.array([self.friction_Nm, np.linalg.norm(self.cogging_Nm, axis=1)])

    @property
    def friction_Nm(self) -> FloatArray:
        """Learnt dry friction of each motor, (n,); kept up to date."""
        return self._x[: TERMS * len(self._cable) : TERMS]

    @property
    def cogging_Nm(self) -> FloatArray:
        """Learnt sine and cosine of each motor's cogging over its electrical angle, (n, 2)."""
        return self._x[: TERMS * len(self._cable)].reshape(-1, TERMS)[:, 1:].copy()
