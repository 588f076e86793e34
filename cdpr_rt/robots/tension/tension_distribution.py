"""Tension distribution for any robot with at least as many cables as controlled directions.

Wanted are tensions t (n,) with W t + w_e = 0, eq. (3.80), and low <= t <= high: W (d, n) is the
wrench matrix, w_e (d,) the wrench of all else on the platform.
"""

from __future__ import annotations

import numpy as np

from cdpr_profiles.platform import TENSION_METHODS
from cdpr_rt.arrays import FloatArray
from cdpr_rt.errors import ControlError
from cdpr_rt.robots.interface import TensionOutcome
from cdpr_rt.robots.tension.distribute import (
    CLOSED_FORM,
    MINIMUM_DEVIATION,
    REFUSED,
    distribute,
)
from cdpr_rt.robots.tension.nearest_wrench import NO_LIMIT
from cdpr_rt.robots.tension.tension_polygon import CENTROID, ONE_NORM, TWO_NORM


class TensionError(ControlError):
    """A tension distribution no robot can have; the message names what and what is allowed."""


_OUTCOMES = tuple(TensionOutcome)  # members of an enumeration are slow to look up


class TensionSolver:
    """Tensions that carry a wrench within their bounds, by one method.

    Keeps nothing from one call to the next: the same W, w_e and bounds give the same tensions.
    `low`, `high` and `wanted` (n,), N, may be changed in place between calls, as for a cable that
    is cut (0 to 0). What is wanted is the middle of the bounds unless said otherwise.
    """

    def __init__(
        self,
        method: int,
        low_N: FloatArray,
        high_N: FloatArray,
        wrench_scale: FloatArray,
        wanted_N: FloatArray | None = None,
    ) -> None:
        """Take the bounds (n,) and, for the d <= n controlled directions, `wrench_scale` (d,).

        `method` is one of `distribute`. `wrench_scale` is what of each direction counts as much as
        1 N where a wrench cannot be carried: 1 for a force and a characteristic length, m, for a
        moment. Raises TensionError.
        """
        low = _vector("lower bounds", low_N)
        n = low.size
        high = _vector("upper bounds", high_N, n)
        wanted = 0.5 * (low + high) if wanted_N is None else _vector("wanted_N", wanted_N, n)
        self._bounds = np.array([low, high, wanted])
        self.low, self.high, self.wanted = self._bounds
        self.wrench_scale = _vector("wrench_scale", wrench_scale)
        self._method, directions = method, self.wrench_scale.size
        if not 1 <= directions <= n:
            raise TensionError(f"{n} cables, {directions} directions; allowed: 1 to {n} directions")
        if method <= CENTROID and n > directions + 2:
            raise TensionError(
                f"{n} cables, {directions} directions; allowed: at most {directions + 2} cables, "
                "whose tensions within bounds are a polygon"
            )
        if not (self.low <= self.high).all():
            i = int(np.argmax(self.low > self.high))
            raise TensionError(
                f"cable {i + 1}: tension bounds {self.low[i]:g} to {self.high[i]:g} N; allowed: "
                "the lower one not above the upper one"
            )
        if not (self.wrench_scale > 0.0).all():
            raise TensionError(f"wrench_scale {self.wrench_scale}; allowed: above 0")
        self.missing = np.zeros(directions)
        """-(W t + w_e), N and Nm: what of the wrench the last tensions leave out."""
        self._limit = NO_LIMIT
        self._scaled, self._space = np.zeros((directions, n + 1)), np.zeros((n + 1, n))
        size = max(n, 8)
        self._scratch = np.zeros((4, size, size))

    def solve(self, W: FloatArray, w_e: FloatArray, t_out: FloatArray) -> TensionOutcome:
        """Write the tensions (n,) for W (d, n) and w_e (d,) into `t_out`.

        All are float64 in C order: another layout is compiled anew where it first comes. `missing`,
        `limiting_cable` and `limiting_bound` then belong to these tensions.
        """
        outcome, limit = distribute(
            self._method, W, w_e, self.wrench_scale, self._bounds, self._scaled, self._space,
            t_out, self.missing, self._scratch,
        )  # fmt: skip
        if outcome != REFUSED:
            self._limit = limit
        return _OUTCOMES[outcome]

    @property
    def limiting_cable(self) -> int:
        """The cable whose bound, moved by 1 N, brings the last tensions nearest to the wrench.

        -1 where the wrench is carried, or no bound is in its way.
        """
        return -1 if self._limit == NO_LIMIT else abs(self._limit) - 1

    @property
    def limiting_bound(self) -> int:
        """Bound of that cable: -1 the lower one, 1 the upper one, 0 none."""
        return 0 if self._limit == NO_LIMIT else (self._limit > 0) - (self._limit < 0)


_BY_NAME = {
    "minimum-norm": MINIMUM_DEVIATION,  # from none
    "minimum-deviation": MINIMUM_DEVIATION,
    "closed-form": CLOSED_FORM,
    "polygon-1-norm": ONE_NORM,
    "polygon-2-norm": TWO_NORM,
    "polygon-centroid": CENTROID,
}
METHODS = TENSION_METHODS


def tension_distribution(
    method: str,
    low_N: FloatArray,
    high_N: FloatArray,
    wrench_scale: FloatArray,
    wanted_N: FloatArray | None = None,
) -> TensionSolver:
    """Return the tension distribution that `method` names, one of METHODS.

    `wrench_scale` (d,) has one entry for each controlled direction, see `TensionSolver`;
    `wanted_N` (n,) belongs to "minimum-deviation". Raises TensionError.
    """
    if method not in _BY_NAME:
        allowed = ", ".join(METHODS)
        raise TensionError(f"method {method!r} of tension distribution; allowed: {allowed}")
    if (method == "minimum-deviation") != (wanted_N is not None):
        raise TensionError(f"wanted tensions for {method}; allowed: with minimum-deviation, only")
    if method == "minimum-norm":
        wanted_N = np.zeros(np.size(low_N))
    return TensionSolver(_BY_NAME[method], low_N, high_N, wrench_scale, wanted_N)


def _vector(name: str, value: FloatArray, size: int | None = None) -> FloatArray:
    vector = np.array(value, float)
    if vector.ndim != 1 or vector.size != (vector.size if size is None else size):
        raise TensionError(f"{name} of shape {vector.shape}; allowed: ({size or 'n'},)")
    if not np.isfinite(vector).all():
        raise TensionError(f"{name} {vector}; allowed: finite numbers")
    return vector
