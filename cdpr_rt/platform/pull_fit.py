"""Friction and cogging of motors, and their angles, from cables that are pulled tight."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from cdpr_profiles import RobotAxis
from cdpr_rt.arrays import BoolArray, FloatArray
from cdpr_rt.jit import bound, jit
from cdpr_rt.platform.motor_learning import (
    COGGING_SHARE,
    FRICTION_SHARE,
    MOST_SHARE,
    MotorLearning,
)

# Kernels that fit a motor's friction and cogging to its rotation while its cable is pulled tight.
# The platform stands at home, so the unstretched length l of a cable depends on its tension alone.
# A tension a is commanded, and the angle θ is measured. With c of cable paid out per radian, and e
# = -dl/dt, a motor that slides obeys, in Nm at the motor, y = c (l(a) - l(P) - c θ)/e = -(c²/e) θ_P
# + s c (a - P) + f sign θ̇ + A sin pθ + B cos pθ, with θ_P the angle at which the cable has the
# tension P, s the relative excess of the tension's growth over the commanded one, f dry friction
# and (A, B) cogging. If the platform slides on its stand while it is pulled harder than before,
# which makes the cable longer by m(a) λ, with m going from 0 at P to 1 at the greatest pull, -(c/e)
# m λ is added. The kernel sums the squares and products of this equation's factors and of y, `sums`
# (n, 7, 7), lower halves. Friction reverses with the direction over the distance in which a contact
# yields before it slides: z in -1 to 1 replaces sign θ̇, dz/dθ = (1 - z sign θ̇)/δ (Dahl, 1968).
# Flicker of an encoder does not count as motion: `seen` (2, n) are the least and the greatest
# angle, as in a model of play.

UNKNOWNS = 5
ANGLE, STEEPER, FRICTION, SINE, COSINE = range(UNKNOWNS)
"""Unknowns of each motor; after them the slide of the platform, and the measured y."""
SLID, MEASURED, FACTORS = range(UNKNOWNS, UNKNOWNS + 3)
PRETENSION_N, M_PER_RAD, POLE_PAIRS, ORIGIN, PLAY, MOST_SHARE_ROW, MOTOR_ROWS = range(7)
"""Rows of `motors` (6, n): P, c, p, the angle from which θ and θ_P are counted, the play, rad, and
the greatest commanded tension so far, relative to P."""
HARDEST_SHARE = 1.5
"""Greatest pull, relative to P."""
YIELD_rad = 0.006
"""δ for motors of 1 to 4 Nm; twice or half this value gives nearly the same results."""


@jit
def take(
    motors: FloatArray,
    shares: FloatArray,
    lengths: FloatArray,
    seen: FloatArray,
    yielding: FloatArray,
    turned: FloatArray,
    sums: FloatArray,
    h: FloatArray,
    position: FloatArray,
    tension: FloatArray,
) -> None:
    """Process the angles (n,) of a cycle at the commanded tensions (n,).

    `lengths` (2, m, n) are l - l(P) and e of each cable at m even `shares` of P. `yielding` (n,)
    are z, `turned` (2, n) the rotation of each motor in either direction, rad. The weight of an
    angle is its distance from the earlier ones. `h` (7,) is overwritten.
    """
    step = shares[1] - shares[0]
    for i in range(position.size):
        share = tension[i] / motors[PRETENSION_N, i]
        motors[MOST_SHARE_ROW, i] = max(motors[MOST_SHARE_ROW, i], share)
        theta = position[i] - motors[ORIGIN, i]
        way = _farther(motors[PLAY, i], seen, theta, i)
        side = math.copysign(1.0, way)
        way = abs(way)
        z = yielding[i] + way / YIELD_rad * (side - yielding[i])
        yielding[i] = min(max(z, -1.0), 1.0)
        at = (share - shares[0]) / step
        if way == 0.0 or not 0.0 <= at < shares.size - 1:
            continue
        k = int(at)
        upper = at - k
        length = (1.0 - upper) * lengths[0, k, i] + upper * lengths[0, k + 1, i]
        e = (1.0 - upper) * lengths[1, k, i] + upper * lengths[1, k + 1, i]
        if e <= 0.0:  # cables that do not stretch give no information
            continue
        c, angle = motors[M_PER_RAD, i], motors[POLE_PAIRS, i] * position[i]
        h[ANGLE], h[STEEPER] = -c * c / e, c * (tension[i] - motors[PRETENSION_N, i])
        h[FRICTION], h[SINE], h[COSINE] = yielding[i], math.sin(angle), math.cos(angle)
        harder = (motors[MOST_SHARE_ROW, i] - 1.0) / (HARDEST_SHARE - 1.0)
        h[SLID] = -c / e * min(max(harder, 0.0), 1.0)
        h[MEASURED] = c * (length - c * theta) / e
        turned[0 if side > 0.0 else 1, i] += way
        for j in range(FACTORS):
            for m in range(j + 1):
                sums[i, j, m] += way * h[j] * h[m]


@jit
def _farther(play: float, seen: FloatArray, theta: float, i: int) -> float:
    """Include an angle of motor i in `seen`; return its signed distance beyond earlier angles."""
    way = 0.0
    if theta > seen[1, i]:
        way = theta - seen[1, i]
        seen[1, i], seen[0, i] = theta, max(seen[0, i], theta - play)
    elif theta < seen[0, i]:
        way = theta - seen[0, i]
        seen[0, i], seen[1, i] = theta, min(seen[1, i], theta + play)
    return way


NOISE_SHARE = 0.01
"""Standard deviation of a motor's other torque losses, as a share of its rated torque."""
_STEEPER, _LEAST_STEEP = 0.15, 0.5
"""Relative error of the growth of a tension (standard deviation), for example due to a wrong
stiffness; and least growth, relative to the commanded one."""
_ALIKE_rad = 0.8
"""Electrical angle below which angles of a motor are not independent."""
_LEAST_SHARE, _MOST_SHARE, _SHARES = 0.3, 1.7, 57
"""Range of tabulated cable lengths, as shares of the pretension, and their number."""
_PULLED_N = 1e-6
_ANYWHERE_rad = 1e3
"""Standard deviation of an unknown angle."""
_COUNTS = 2.0
"""Counts within which the encoder of a stationary motor flickers."""
_TURNED_rad = 0.005
"""Rotation in each direction that a motor needs for a reliable result."""
_SLID_rad = 3.0 * YIELD_rad
"""Rotation after which a motor's friction has almost completely reversed."""
_CERTAIN = 0.7
"""The friction of other motors of the same kind is used if its standard deviation is below this
share of the usual friction."""
_MISFIT = 3.0
"""Ratio of residual to noise above which a fit is rejected, for example because the platform
moved."""
_SLIDE_m = 0.005
"""Usual slide of a platform on its stand (standard deviation), at its anchor points."""
_SLIDES = (10.8, 13.8, 16.3)
"""Chi squared, for one to three slide directions, that noise exceeds once in a thousand."""
_SLOW_SHARE, _UNLIKE = 0.8, 0.25
"""Ratio of friction in motion to that of an almost stationary motor; relative scatter among motors
of a kind."""


class PullFit:
    """Friction, cogging and the angle at the pretension of each motor, while the platform stands.

    See above. It is a least-squares fit to all cycles, with a prior of zero friction and cogging
    and the standard deviations of `MotorLearning`. Motors of a kind, with the same gear, have
    similar friction: if a motor hardly reverses, the friction of the others is its prior. Motors
    that are `known` (n,) are not fitted. The `learning` starts from the results.

    A platform that slides on its stand while it is pulled harder than before makes all cables
    longer by `slides` Δ. Δ (k,) is only used if it is significant: Δ^T C^-1 Δ, divided by the
    remaining variance, must exceed the value that noise alone exceeds once in a thousand (data
    snooping, as in Baarda, 1968). Otherwise the platform counts as stationary.
    """

    def __init__(
        self,
        axes: Sequence[RobotAxis],
        known: BoolArray,
        lengths_at_home: Callable[[FloatArray], FloatArray],
        learning: MotorLearning | None,
        slides: FloatArray,
    ) -> None:
        """Take the function that returns the unstretched lengths (n,) at home for tensions (n,).

        `slides` (n, k), k up to 3, is the lengthening of each cable for each direction in which the
        platform may slide, in m per m at its anchor points.
        """
        n = len(axes)
        self._slides = slides
        self._known, self._learning, self._lengths_at_home = known, learning, lengths_at_home
        self._rated_Nm = np.array([axis.winch.motor.rated_torque_Nm for axis in axes])
        kinds = [(axis.winch.motor.model, axis.winch.gear_ratio) for axis in axes]
        self._of_a_kind = np.array([[one == other for other in kinds] for one in kinds])
        self._motors = np.ones((MOTOR_ROWS, n))
        self._motors[M_PER_RAD] = [axis.winch.cable_m_per_motor_rad for axis in axes]
        rated_N = self._rated_Nm / np.abs(self._motors[M_PER_RAD])
        self.taken_up_N = (MOST_SHARE + COGGING_SHARE) * rated_N
        """Largest usual friction of the winches, as tensions of their cables, (n,)."""
        self._motors[POLE_PAIRS] = [axis.winch.motor.pole_pairs for axis in axes]
        self._alike_rad = _ALIKE_rad / self._motors[POLE_PAIRS]
        usual = np.full((n, UNKNOWNS), [_ANYWHERE_rad, _STEEPER, np.inf, 1.0, 1.0])
        usual[:, FRICTION + 1 :] = COGGING_SHARE * self._rated_Nm[:, None]
        self._usual_precision = np.eye(UNKNOWNS) * usual[:, None] ** -2.0
        """Prior information about all unknowns except friction, (n, 5, 5)."""
        self._shares = np.linspace(_LEAST_SHARE, _MOST_SHARE, _SHARES)
        self._lengths = np.ones((2, _SHARES, n))
        self.count_rad = np.array([math.tau / axis.winch.encoder_counts_per_turn for axis in axes])
        """Resolution of each encoder, (n,)."""
        self._motors[PLAY] = _COUNTS * self.count_rad
        self._seen, self._turned = np.zeros((2, 2, n))
        self._yielding = np.zeros(n)
        self._sums = np.zeros((n, FACTORS, FACTORS))
        self.unknowns = np.zeros((n, UNKNOWNS))
        """The results, (n, 5)."""
        self._found = np.zeros(n, np.bool_)
        self._covariance = np.zeros((n, UNKNOWNS, UNKNOWNS))
        self._take = bound(
            take, self._motors, self._shares, self._lengths, self._seen, self._yielding,
            self._turned, self._sums, np.zeros(FACTORS), then=(np.zeros(n), np.zeros(n)),
        )  # fmt: skip

    def prepare(self, tension_N: FloatArray) -> None:
        """Take the pretension (n,) around which cables are pulled."""
        pretension_N = np.maximum(tension_N, _PULLED_N)
        self._motors[PRETENSION_N] = pretension_N
        at_tension = self._lengths_at_home(tension_N)
        for row, share in zip(self._lengths[0], self._shares, strict=True):
            row[:] = self._lengths_at_home(share * tension_N) - at_tension
        slope = np.gradient(self._lengths[0], self._shares, axis=0)
        self._lengths[1] = -slope / pretension_N
        self.end()  # loads parts of numpy that must not be loaded in a cycle

    def begin(self, position_rad: FloatArray) -> None:
        """Begin again at these angles (n,), at which the cables have been reeled in."""
        self._motors[ORIGIN] = position_rad
        self._motors[MOST_SHARE_ROW] = 1.0
        self._seen[:] = self._turned[:] = self._sums[:] = 0.0
        self._yielding[:] = -np.sign(self._motors[M_PER_RAD])

    def take(self, position_rad: FloatArray, tension_N: FloatArray) -> None:
        """Process a cycle's angles (n,) and the commanded tensions, (n,)."""
        self._take(position_rad, tension_N)

    def end(self) -> FloatArray:
        """Return the angles (n,) at which the cables have the pretension, nan if unknown."""
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
        turned |= (self._turned >= _SLID_rad).any(axis=0) & (spread_Nm < _CERTAIN * usual_Nm)
        self._found[:] = ~self._known & turned & (misfit < _MISFIT)
        angle_rad = self._motors[ORIGIN] + self.unknowns[:, ANGLE]
        return np.where(self._found, angle_rad, np.nan)

    def begin_learning(self) -> None:
        """Begin the learning with the last results, for motors that it does not know yet.

        If a motor turned by less than a period, its cogging looks like another stiffness and is
        left out.
        """
        if self._learning is None:
            return
        of_torques = slice(FRICTION, None)
        torques = self.unknowns[:, of_torques].copy()
        torques[:, 0] *= _SLOW_SHARE
        covariance = self._covariance[:, of_torques, of_torques].copy()
        covariance[:, 0, 0] += (_UNLIKE * torques[:, 0]) ** 2
        less = self._motors[POLE_PAIRS] * self._turned.min(axis=0) < math.tau
        torques[less, 1:] = covariance[less, 0, 1:] = covariance[less, 1:] = 0.0
        usual_Nm = COGGING_SHARE * self._rated_Nm
        covariance[:, [1, 2], [1, 2]] += np.where(less, usual_Nm**2, 0.0)[:, None]
        self._learning.begin_with(self._found, torques, covariance)

    def _expected(self, sums: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the friction of each motor expected from the others, and its standard
        deviation.
        """
        zero, usual_Nm = np.zeros(self._rated_Nm.size), FRICTION_SHARE * self._rated_Nm
        misfit, x, covariance = self._fit(sums, zero, usual_Nm)
        alone_Nm, variance = x[:, FRICTION], covariance[:, FRICTION, FRICTION]
        own_weight = (~self._known & (misfit < _MISFIT)) / _wider(misfit)
        return self._of_their_kind(own_weight, alone_Nm, variance, usual_Nm)

    def _slide(
        self, sums: FloatArray, friction_Nm: FloatArray, spread_Nm: FloatArray
    ) -> FloatArray:
        """Return how far the platform has slid, (k,), 0 if that is not significant.

        The other unknowns of each motor are eliminated: a_i and b_i are what remains of the squared
        factor of the slide, and of its product with the measured y.
        """
        m, slid, slides = UNKNOWNS, SLID, self._slides
        none = np.zeros(slides.shape[1])
        if self._known.any():
            return none  # the lengths of motors that are not fitted include the slide
        precision, known = self._with_usual(sums, friction_Nm, spread_Nm)
        fitted = np.linalg.solve(precision, np.stack([sums[:, :m, slid], known], axis=2))
        a, b = sums[:, slid, [slid, MEASURED]].T - np.einsum(
            "ij,ijk->ki", sums[:, :m, slid], fitted
        )
        certain = (slides.T * a) @ slides + np.eye(none.size) * _SLIDE_m**-2.0
        slide = np.asarray(np.linalg.solve(certain, slides.T @ b))
        misfit = self._fit(_moved_back(sums, slides @ slide), friction_Nm, spread_Nm)[0]
        own_weight = self._own_weight()
        noise = max(float((misfit**2 * own_weight).sum() / own_weight.sum()), 1.0)
        significant = slide @ certain @ slide > noise * _SLIDES[none.size - 1]
        return slide if significant else none

    def _of_their_kind(
        self,
        own_weight: FloatArray,
        friction_Nm: FloatArray,
        variance: FloatArray,
        usual_Nm: FloatArray,
    ) -> tuple[FloatArray, FloatArray]:
        """Return mean and standard deviation (n,) of friction of the other motors of each kind.

        It uses the friction found for each motor alone, with the prior 0 ± `usual_Nm`, and its
        variance. `own_weight` (n,), 0 to 1, is the weight of a motor's own data against the prior.
        Without evidence from the others the result is 0 ± `usual_Nm` and a quarter of it.
        """
        others = (self._of_a_kind & ~np.eye(own_weight.size, dtype=np.bool_)) * own_weight
        precision = np.maximum(1.0 / variance - usual_Nm**-2.0, 0.0)
        weighted = friction_Nm / variance  # weighted by the precision of this motor's data
        mean_Nm = (others @ weighted) / (others @ precision + usual_Nm**-2.0)
        unlike = (_UNLIKE**2 * (mean_Nm**2 + usual_Nm**2))[:, None]
        counts = others / (1.0 + others * precision * unlike)
        known = (counts * precision).sum(axis=1) + usual_Nm**-2.0
        return (counts * weighted).sum(axis=1) / known, np.sqrt(unlike[:, 0] + 1.0 / known)

    def _weighted_sums(self) -> FloatArray:
        """Return the sums (n, 7, 7), divided by the variance of the motor's other torque losses."""
        sums = self._sums + np.swapaxes(np.tril(self._sums, -1), 1, 2)
        noise = self._alike_rad * (NOISE_SHARE * self._rated_Nm) ** 2
        return np.asarray(sums / noise[:, None, None])

    def _fit(
        self, sums: FloatArray, friction_Nm: FloatArray, spread_Nm: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return each motor's ratio of residual to noise, (n,), results, (n, 5), and covariance.

        The prior of the friction is `friction_Nm` ± `spread_Nm`, (n,). Covariances are (n, 5, 5).
        """
        m, y = UNKNOWNS, MEASURED
        products, rest = sums[:, :m, :m], sums[:, :m, y]
        precision, known = self._with_usual(sums, friction_Nm, spread_Nm)
        covariance = np.asarray(np.linalg.inv(precision), float)
        x = (covariance @ known[:, :, None])[:, :, 0]
        left = sums[:, y, y] + (x * ((products @ x[:, :, None])[:, :, 0] - 2.0 * rest)).sum(axis=1)
        misfit = np.maximum(left, 0.0) / self._own_weight()
        # with softer cables all torques look larger
        x[:, FRICTION:] /= np.maximum(1.0 + x[:, [STEEPER]], _LEAST_STEEP)
        return np.sqrt(misfit), x, covariance

    def _with_usual(
        self, sums: FloatArray, friction_Nm: FloatArray, spread_Nm: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return the normal equations of each motor, (n, 5, 5) and (n, 5), with the priors."""
        m, f = UNKNOWNS, FRICTION
        precision = sums[:, :m, :m] + self._usual_precision
        precision[:, f, f] += spread_Nm**-2.0
        known = sums[:, :m, MEASURED].copy()
        known[:, f] += friction_Nm / spread_Nm**2
        return precision, known

    def _own_weight(self) -> FloatArray:
        """Return the number of independent angles of each motor, (n,)."""
        return np.asarray(np.maximum(self._turned.sum(axis=0), _TURNED_rad) / self._alike_rad)


def _moved_back(sums: FloatArray, longer_m: FloatArray) -> FloatArray:
    """Return the sums (n, 7, 7) after removing a lengthening `longer_m` (n,) of the cables."""
    moved, slid, y = sums.copy(), sums[:, :, SLID] * longer_m[:, None], MEASURED
    moved[:, :, y] -= slid
    moved[:, y, :] = moved[:, :, y]
    moved[:, y, y] = sums[:, y, y] - 2.0 * slid[:, y] + longer_m * slid[:, SLID]
    return moved


def _wider(misfit: FloatArray) -> FloatArray:
    """Return the factor on variances, at least 1, for a ratio of residual to noise."""
    return np.maximum(misfit, 1.0) ** 2
