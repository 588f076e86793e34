"""What a platform's control learns of motors that were not commissioned, while it moves."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cdpr_profiles import RobotAxis
from cdpr_rt.arrays import BoolArray, FloatArray
from cdpr_rt.jit import bound
from cdpr_rt.robots.platform.design.loop_gains import latency_s
from cdpr_rt.robots.platform.learning import learning_kernel as kernel

POLE_rad_s = 19.0
"""Of the low-pass: below the platform's swinging on its cables, above most of its own motion."""
FRICTION_SHARE, COGGING_SHARE = 0.04, 0.03
"""What friction and cogging usually are (standard deviation), over the motor's rated torque."""
MOST_SHARE, MOST_RESERVE_SHARE = 0.08, 1.0 / 3.0
"""What they are at most, each: the less of a share of the rated torque, and of what puts a cable's
tension off by a share of the reserve that tensions are planned with."""
WRENCH_SHARE, NOISE_SHARE = 0.25, 0.09
"""What the platform's wrench is off, and one cycle's equation, over the cables' rated tension."""
REVERSAL_rad_s = 0.1
MOTORS_FADING_S, WRENCH_FADING_S = 600.0, 300.0
"""Of the wrench so long that within a second it changes by less than friction turns round by, 2 %
of the cables' rated tension: what changes its sign with the motion is not laid to it."""
_UNSURE = 2.0
"""By how many of its standard deviations friction in motion may be above what was found at rest."""
_SETTLING_S = 0.3
"""Nothing is learnt after a change of programs, whose torques are handed over meanwhile."""


class MotorLearning:
    """Friction of n motors and their cogging once per pole pair, from the platform's motion.

    See `learning_kernel`. Nothing is learnt of the motors that are `known` (n,).
    """

    def __init__(
        self,
        axes: Sequence[RobotAxis],
        known: BoolArray,
        scale: FloatArray,
        reserve_N: float,
        period_s: float,
    ) -> None:
        """Take how far a unit of each direction counts, `scale` (d,), and the tensions' reserve."""
        n, d = len(axes), scale.size
        m = kernel.TERMS * n + d
        rated_Nm = np.array([axis.winch.motor.rated_torque_Nm for axis in axes])
        cable = np.array([axis.winch.cable_m_per_motor_rad for axis in axes])
        rated_N = float((rated_Nm / np.abs(cable)).mean())
        self.settings = np.zeros(kernel.SETTINGS)
        self.settings[kernel.PERIOD], self.settings[kernel.POLE] = period_s, POLE_rad_s
        self.settings[kernel.REVERSAL] = REVERSAL_rad_s
        self.settings[kernel.LATENCY] = latency_s(period_s)
        self.settings[kernel.NOISE_N] = NOISE_SHARE * rated_N
        self._states = np.zeros((kernel.STATE_ROWS, m))
        shares = np.tile([FRICTION_SHARE, COGGING_SHARE, COGGING_SHARE], n)
        of_motors = np.repeat(np.where(known, 0.0, rated_Nm), kernel.TERMS)
        self._states[kernel.SIGMA] = [*(shares * of_motors), *(WRENCH_SHARE * rated_N * scale)]
        self._states[kernel.FADING] = [MOTORS_FADING_S] * (m - d) + [WRENCH_FADING_S] * d
        self._scale, self._cable = scale, cable
        self._pole_pairs = np.array([float(axis.winch.motor.pole_pairs) for axis in axes])
        self._usual_Nm = np.minimum(
            MOST_SHARE * rated_Nm, MOST_RESERVE_SHARE * reserve_N * np.abs(cable)
        )
        self._largest_Nm = MOST_SHARE * rated_Nm
        self.most_Nm = np.zeros((3, n))
        """What friction, cogging, and both together of each motor are at most, (3, n)."""
        self.most_Nm[2] = 2.0 * MOST_RESERVE_SHARE * reserve_N * np.abs(cable)
        self._x, self._P = np.zeros(m), np.zeros((m, m))
        self._terms, self._filters = np.zeros((n, kernel.TERMS)), np.zeros(4 * n + 2 * d)
        self._direction = 0
        self._settling = self._cycles = round(_SETTLING_S / period_s)
        self.torque_Nm = np.zeros(n)
        """What is added to the torques for it, (n,)."""
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
        """Fix the control's arrays: motors (n,), J (n, d), mass (d, d), error of twist, force.

        `added_Nm` (n,) is all that was added to the torques, what is learnt among it.
        """
        self._learn = bound(
            kernel.learn, self.settings, self._states, self._scale, self._cable, J, M, v, force,
            self._terms, added_Nm, self.most_Nm, self._filters, self._x, self._P,
            np.zeros((2, self._x.size)), then=(0, True),
        )  # fmt: skip
        self._write = bound(
            kernel.write_learnt, self.settings, self._pole_pairs, self.most_Nm, self._x,
            theta, omega, self._terms, self.torque_Nm, then=(np.zeros(len(theta)),),
        )  # fmt: skip

    def learn(self, usable: bool) -> None:
        """Learn from the cycle past; `usable` is whether the force bound was exerted in it."""
        self._settling = max(self._settling - 1, 0)
        self._direction = self._learn(self._direction, usable and not self._settling)

    def write(self, wanted_rad_s: FloatArray) -> None:
        """Write `torque_Nm` for motors that are wanted at these speeds (n,)."""
        self._write(wanted_rad_s)

    def restart(self) -> None:
        """Begin anew after cycles without this control; what was learnt stays."""
        self._settling = self._cycles
        self._filters[:] = self._terms[:] = self.torque_Nm[:] = 0.0

    def forget(self) -> None:
        """Forget what was learnt, as where the encoders have begun anew."""
        self.restart()
        self.most_Nm[:2] = self._usual_Nm
        self._x[:] = 0.0
        self._P[:] = np.diag(self._states[kernel.SIGMA] ** 2)

    def begin_with(self, found: BoolArray, torque_Nm: FloatArray, covariance: FloatArray) -> None:
        """Begin with what was `found` (n,) at rest of motors of which nothing is known yet.

        `torque_Nm` (n, 3) are friction, sine and cosine of the cogging, `covariance` (n, 3, 3).
        Friction may be as much as was found and what that is unsure by, within what both are at
        most together: a motor that all but stands tells what it rubs elsewhere, and loaded
        otherwise, to a quarter at best.
        """
        terms = self._x[: kernel.TERMS * found.size].reshape(-1, kernel.TERMS)
        found = found & ~terms.any(axis=1)  # what was learnt in motion is better
        friction = torque_Nm[:, 0] + _UNSURE * np.sqrt(covariance[:, 0, 0])
        most = self.most_Nm
        room = np.maximum(np.minimum(friction, self._largest_Nm), self._usual_Nm)
        most[0] = np.where(found, np.minimum(room, most[2]), most[0])
        bounds = most[[0, 1, 1]].T
        for i in np.flatnonzero(found):
            motor = slice(kernel.TERMS * i, kernel.TERMS * (i + 1))
            self._x[motor] = np.clip(torque_Nm[i], [0.0, *-bounds[i, 1:]], bounds[i])
            self._P[motor, motor] = covariance[i]

    @property
    def learnt_Nm(self) -> FloatArray:
        """Friction and amplitude of the cogging of each motor, (2, n)."""
        return np.array([self.friction_Nm, np.linalg.norm(self.cogging_Nm, axis=1)])

    @property
    def friction_Nm(self) -> FloatArray:
        """Dry friction of each motor as learnt, (n,); kept up to date."""
        return self._x[: kernel.TERMS * len(self._cable) : kernel.TERMS]

    @property
    def cogging_Nm(self) -> FloatArray:
        """Sine and cosine of each motor's cogging over its electrical angle, as learnt, (n, 2)."""
        return self._x[: kernel.TERMS * len(self._cable)].reshape(-1, kernel.TERMS)[:, 1:].copy()
