"""What motors take up of their torque, and where they stand, from cables that are pulled tight."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from cdpr_profiles import RobotAxis
from cdpr_rt.arrays import BoolArray, FloatArray
from cdpr_rt.jit import bound
from cdpr_rt.robots.platform.learning import pull_kernel as kernel
from cdpr_rt.robots.platform.learning.motor_learning import (
    COGGING_SHARE,
    FRICTION_SHARE,
    MOST_SHARE,
    MotorLearning,
)

NOISE_SHARE = 0.01
"""What else a motor takes up (standard deviation), over its rated torque."""
_STEEPER, _LEAST_STEEP = 0.15, 0.5
"""By how much a tension grows otherwise than is asked for (standard deviation), as with another
stiffness; and the least that it grows, over what is asked for."""
_ALIKE_rad = 0.8
"""Of a motor's electrical turn: angles as near tell no more than one."""
_LEAST_SHARE, _MOST_SHARE, _SHARES = 0.3, 1.7, 57
"""Of the pretension, between which the cables' lengths are kept."""
_PULLED_N = 1e-6
_ANYWHERE_rad = 1e3
"""Standard deviation of an angle of which nothing is known."""
_COUNTS = 2.0
"""Within which an encoder shows to and fro what stands."""
_TURNED_rad = 0.005
"""How far a motor has to turn in both directions for what is found to be believed."""
_SLID_rad = 3.0 * kernel.YIELD_rad
"""How far a motor turns until its friction has all but turned round."""
_TOLD = 0.7
"""Standard deviation of friction, over what is usual, with which others of a kind tell it."""
_MISFIT = 3.0
"""Residual over noise above which a fit is not believed, as where the platform has moved."""
_SLIDE_m = 0.005
"""By how much a platform may slide on its stand (standard deviation), at its anchor points."""
_SLIDES = (10.8, 13.8, 16.3)
"""Chi squared of one to three slides that noise exceeds once in a thousand."""
_SLOW_SHARE, _UNLIKE = 0.8, 0.25
"""Friction in motion, over that of a motor that all but stands; and how unlike it may be."""


class PullFit:
    """Friction, cogging and the angle at the pretension of each motor, while the platform stands.

    See `pull_kernel`; a least-squares fit of what all cycles tell, with what is usual of friction
    and cogging (zero, with the standard deviations of `MotorLearning`). Motors of a kind, with the
    same gear, rub alike: what the others tell is expected of one whose own friction hardly turns
    round. Nothing is found of motors that are `known` (n,). What is found is where the `learning`
    begins, once it is to.

    A platform that slides on its stand while it is pulled harder than before makes all cables
    longer by `slides` Δ. Of Δ (k,) is believed what is significant: Δ^T C^-1 Δ, over the variance
    that is left, above what noise alone exceeds once in a thousand (data snooping, as in Baarda,
    1968). Else the platform has stood still.
    """

    def __init__(
        self,
        axes: Sequence[RobotAxis],
        known: BoolArray,
        lengths_at_home: Callable[[FloatArray], FloatArray],
        learning: MotorLearning | None,
        slides: FloatArray,
    ) -> None:
        """Take what the lengths without tension (n,) at home are for tensions (n,).

        `slides` (n, k), k up to 3, is what each cable is longer by for each way in which the
        platform may slide, in m for each m at its anchor points.
        """
        n = len(axes)
        self._slides = slides
        self._known, self._learning, self._lengths_at_home = known, learning, lengths_at_home
        self._rated_Nm = np.array([axis.winch.motor.rated_torque_Nm for axis in axes])
        kinds = [(axis.winch.motor.model, axis.winch.gear_ratio) for axis in axes]
        self._of_a_kind = np.array([[one == other for other in kinds] for one in kinds])
        self._motors = np.ones((kernel.MOTOR_ROWS, n))
        self._motors[kernel.M_PER_RAD] = [axis.winch.cable_m_per_motor_rad for axis in axes]
        rated_N = self._rated_Nm / np.abs(self._motors[kernel.M_PER_RAD])
        self.taken_up_N = (MOST_SHARE + COGGING_SHARE) * rated_N
        """What winches usually take up of their cables' tensions at most, (n,)."""
        self._motors[kernel.POLE_PAIRS] = [axis.winch.motor.pole_pairs for axis in axes]
        self._alike_rad = _ALIKE_rad / self._motors[kernel.POLE_PAIRS]
        usual = np.full((n, kernel.UNKNOWNS), [_ANYWHERE_rad, _STEEPER, np.inf, 1.0, 1.0])
        usual[:, kernel.FRICTION + 1 :] = COGGING_SHARE * self._rated_Nm[:, None]
        self._usual_precision = np.eye(kernel.UNKNOWNS) * usual[:, None] ** -2.0
        """Of all but friction, (n, 5, 5)."""
        self._shares = np.linspace(_LEAST_SHARE, _MOST_SHARE, _SHARES)
        self._lengths = np.ones((2, _SHARES, n))
        self.count_rad = np.array([math.tau / axis.winch.encoder_counts_per_turn for axis in axes])
        """Resolution of each encoder, (n,)."""
        self._motors[kernel.PLAY] = _COUNTS * self.count_rad
        self._seen, self._turned = np.zeros((2, 2, n))
        self._yielding = np.zeros(n)
        self._sums = np.zeros((n, kernel.FACTORS, kernel.FACTORS))
        self.unknowns = np.zeros((n, kernel.UNKNOWNS))
        """What was found, (n, 5)."""
        self._found = np.zeros(n, np.bool_)
        self._covariance = np.zeros((n, kernel.UNKNOWNS, kernel.UNKNOWNS))
        self._take = bound(
            kernel.take, self._motors, self._shares, self._lengths, self._seen, self._yielding,
            self._turned, self._sums, np.zeros(kernel.FACTORS), then=(np.zeros(n), np.zeros(n)),
        )  # fmt: skip

    def prepare(self, tension_N: FloatArray) -> None:
        """Take the pretension (n,) that is pulled around."""
        pretension_N = np.maximum(tension_N, _PULLED_N)
        self._motors[kernel.PRETENSION_N] = pretension_N
        at_tension = self._lengths_at_home(tension_N)
        for row, share in zip(self._lengths[0], self._shares, strict=True):
            row[:] = self._lengths_at_home(share * tension_N) - at_tension
        slope = np.gradient(self._lengths[0], self._shares, axis=0)
        self._lengths[1] = -slope / pretension_N
        self.end()  # what numpy loads for it is not to be loaded in a cycle

    def begin(self, position_rad: FloatArray) -> None:
        """Begin anew, at these angles (n,), to which the cables have been reeled in."""
        self._motors[kernel.ORIGIN] = position_rad
        self._motors[kernel.MOST_SHARE] = 1.0
        self._seen[:] = self._turned[:] = self._sums[:] = 0.0
        self._yielding[:] = -np.sign(self._motors[kernel.M_PER_RAD])

    def take(self, position_rad: FloatArray, tension_N: FloatArray) -> None:
        """Take in a cycle's angles (n,) and the tensions asked for, (n,)."""
        self._take(position_rad, tension_N)

    def end(self) -> FloatArray:
        """Return the angles (n,) at which the cables have the pretension, nan where not known."""
        usual_Nm, sums = FRICTION_SHARE * self._rated_Nm, self._weighted_sums()
        mean_Nm, spread_Nm = self._expected(sums)
        slide = self._slide(sums, mean_Nm, spread_Nm)
        if slide.any():
            sums = _moved_back(sums, self._slides @ slide)
            mean_Nm, spread_Nm = self._expected(sums)
        misfit, x, covariance = self._fit(sums, mean_Nm, spread_Nm)
        self.unknowns[:] = x
        self._covariance[:] = covariance * _wider(misfit)[:, None, None]
        turned = (self._turned >= _TURNED_rad).all(axis=0)
        turned |= (self._turned >= _SLID_rad).any(axis=0) & (spread_Nm < _TOLD * usual_Nm)
        self._found[:] = ~self._known & turned & (misfit < _MISFIT)
        angle_rad = self._motors[kernel.ORIGIN] + self.unknowns[:, kernel.ANGLE]
        return np.where(self._found, angle_rad, np.nan)

    def begin_learning(self) -> None:
        """Begin the learning with what was found last, of motors of which it knows nothing yet.

        Over less than a period cogging cannot be told from another stiffness: it is left out.
        """
        if self._learning is None:
            return
        of_torques = slice(kernel.FRICTION, None)
        torques = self.unknowns[:, of_torques].copy()
        torques[:, 0] *= _SLOW_SHARE
        covariance = self._covariance[:, of_torques, of_torques].copy()
        covariance[:, 0, 0] += (_UNLIKE * torques[:, 0]) ** 2
        less = self._motors[kernel.POLE_PAIRS] * self._turned.min(axis=0) < math.tau
        torques[less, 1:] = covariance[less, 0, 1:] = covariance[less, 1:] = 0.0
        usual_Nm = COGGING_SHARE * self._rated_Nm
        covariance[:, [1, 2], [1, 2]] += np.where(less, usual_Nm**2, 0.0)[:, None]
        self._learning.begin_with(self._found, torques, covariance)

    def _expected(self, sums: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return what friction is expected of each motor by what others tell, and its spread."""
        zero, usual_Nm = np.zeros(self._rated_Nm.size), FRICTION_SHARE * self._rated_Nm
        misfit, x, covariance = self._fit(sums, zero, usual_Nm)
        alone_Nm, variance = x[:, kernel.FRICTION], covariance[:, kernel.FRICTION, kernel.FRICTION]
        told = (~self._known & (misfit < _MISFIT)) / _wider(misfit)
        return self._of_their_kind(told, alone_Nm, variance, usual_Nm)

    def _slide(
        self, sums: FloatArray, friction_Nm: FloatArray, spread_Nm: FloatArray
    ) -> FloatArray:
        """Return by how much the platform has slid, (k,), 0 where that is not significant.

        What each motor is fitted by besides is eliminated: a_i and b_i are what is left of the
        squares of the slide's factor, and of its product with what is measured.
        """
        m, slid, slides = kernel.UNKNOWNS, kernel.SLID, self._slides
        none = np.zeros(slides.shape[1])
        if self._known.any():
            return none  # lengths of motors that are not fitted are those after it
        precision, known = self._with_usual(sums, friction_Nm, spread_Nm)
        fitted = np.linalg.solve(precision, np.stack([sums[:, :m, slid], known], axis=2))
        a, b = sums[:, slid, [slid, kernel.MEASURED]].T - np.einsum(
            "ij,ijk->ki", sums[:, :m, slid], fitted
        )
        certain = (slides.T * a) @ slides + np.eye(none.size) * _SLIDE_m**-2.0
        slide = np.asarray(np.linalg.solve(certain, slides.T @ b))
        misfit = self._fit(_moved_back(sums, slides @ slide), friction_Nm, spread_Nm)[0]
        told = self._told()
        noise = max(float((misfit**2 * told).sum() / told.sum()), 1.0)
        significant = slide @ certain @ slide > noise * _SLIDES[none.size - 1]
        return slide if significant else none

    def _of_their_kind(
        self, told: FloatArray, friction_Nm: FloatArray, variance: FloatArray, usual_Nm: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return how the others of each motor's kind rub, (n,): mean, and standard deviation.

        From what was found of each alone, with friction usually 0 ± `usual_Nm`, and its variance.
        What a motor tells beyond that counts `told` (n,) times, 0 to 1. Where the others tell
        nothing it is 0 ± `usual_Nm`, and a quarter of it.
        """
        others = (self._of_a_kind & ~np.eye(told.size, dtype=np.bool_)) * told
        precision = np.maximum(1.0 / variance - usual_Nm**-2.0, 0.0)
        weighted = friction_Nm / variance  # by the precision of what this motor has told
        mean_Nm = (others @ weighted) / (others @ precision + usual_Nm**-2.0)
        unlike = (_UNLIKE**2 * (mean_Nm**2 + usual_Nm**2))[:, None]
        counts = others / (1.0 + others * precision * unlike)
        known = (counts * precision).sum(axis=1) + usual_Nm**-2.0
        return (counts * weighted).sum(axis=1) / known, np.sqrt(unlike[:, 0] + 1.0 / known)

    def _weighted_sums(self) -> FloatArray:
        """Return the sums (n, 7, 7) over the variance of what else a motor takes up."""
        sums = self._sums + np.swapaxes(np.tril(self._sums, -1), 1, 2)
        noise = self._alike_rad * (NOISE_SHARE * self._rated_Nm) ** 2
        return np.asarray(sums / noise[:, None, None])

    def _fit(
        self, sums: FloatArray, friction_Nm: FloatArray, spread_Nm: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return of each motor residual over noise, (n,), what was found, (n, 5), its covariance.

        Its friction is expected to be `friction_Nm` ± `spread_Nm`, (n,). Covariances are (n, 5, 5).
        """
        m, y = kernel.UNKNOWNS, kernel.MEASURED
        products, rest = sums[:, :m, :m], sums[:, :m, y]
        precision, known = self._with_usual(sums, friction_Nm, spread_Nm)
        covariance = np.asarray(np.linalg.inv(precision), float)
        x = (covariance @ known[:, :, None])[:, :, 0]
        left = sums[:, y, y] + (x * ((products @ x[:, :, None])[:, :, 0] - 2.0 * rest)).sum(axis=1)
        misfit = np.maximum(left, 0.0) / self._told()
        # cables that are softer show all torques larger
        x[:, kernel.FRICTION :] /= np.maximum(1.0 + x[:, [kernel.STEEPER]], _LEAST_STEEP)
        return np.sqrt(misfit), x, covariance

    def _with_usual(
        self, sums: FloatArray, friction_Nm: FloatArray, spread_Nm: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return the normal equations of each motor, (n, 5, 5) and (n, 5), with what is usual."""
        m, f = kernel.UNKNOWNS, kernel.FRICTION
        precision = sums[:, :m, :m] + self._usual_precision
        precision[:, f, f] += spread_Nm**-2.0
        known = sums[:, :m, kernel.MEASURED].copy()
        known[:, f] += friction_Nm / spread_Nm**2
        return precision, known

    def _told(self) -> FloatArray:
        """Return how many independent angles each motor has told, (n,)."""
        return np.asarray(np.maximum(self._turned.sum(axis=0), _TURNED_rad) / self._alike_rad)


def _moved_back(sums: FloatArray, longer_m: FloatArray) -> FloatArray:
    """Return the sums (n, 7, 7) as they were had the cables not become longer, by (n,)."""
    moved, slid, y = sums.copy(), sums[:, :, kernel.SLID] * longer_m[:, None], kernel.MEASURED
    moved[:, :, y] -= slid
    moved[:, y, :] = moved[:, :, y]
    moved[:, y, y] = sums[:, y, y] - 2.0 * slid[:, y] + longer_m * slid[:, kernel.SLID]
    return moved


def _wider(misfit: FloatArray) -> FloatArray:
    """Return what variances are multiplied by for a residual over noise, at least 1."""
    return np.maximum(misfit, 1.0) ** 2
