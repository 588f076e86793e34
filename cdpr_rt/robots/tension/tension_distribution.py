"""Tension distribution for any robot with at least as many cables as controlled directions.

Wanted are tensions t (n,) with W t + w_e = 0, eq. (3.80), and low <= t <= high: W (d, n) is the
wrench matrix, w_e (d,) the wrench of all else on the platform.
"""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np

from cdpr_profiles.platform import TENSION_METHODS
from cdpr_rt.arrays import FloatArray
from cdpr_rt.errors import ControlError
from cdpr_rt.robots.interface import TensionOutcome
from cdpr_rt.robots.tension.nearest_wrench import NO_LIMIT, nearest_wrench
from cdpr_rt.robots.tension.null_space import null_space
from cdpr_rt.robots.tension.tension_closed_form import closed_form
from cdpr_rt.robots.tension.tension_polygon import CENTROID, ONE_NORM, TWO_NORM, choose
from cdpr_rt.robots.tension.tension_qp import project


class TensionError(ControlError):
    """A tension distribution no robot can have; the message names what and what is allowed."""


# members of an enumeration are slow to look up
_FEASIBLE, _SUBSTITUTED, _NEAREST, _SINGULAR, _REFUSED = TensionOutcome


class TensionSolver(ABC):
    """Tensions that carry a wrench within their bounds, by one method.

    Keeps nothing from one call to the next: the same W, w_e and bounds give the same tensions.
    `low`, `high` and `wanted` (n,), N, may be changed in place between calls, as for a cable that
    is cut (0 to 0). What is wanted is the middle of the bounds unless said otherwise.
    """

    def __init__(
        self,
        low_N: FloatArray,
        high_N: FloatArray,
        wrench_scale: FloatArray,
        wanted_N: FloatArray | None = None,
    ) -> None:
        """Take the bounds (n,) and, for the d <= n controlled directions, `wrench_scale` (d,).

        `wrench_scale` is what of each direction counts as much as 1 N where a wrench cannot be
        carried: 1 for a force and a characteristic length, m, for a moment. Raises TensionError.
        """
        low = _vector("lower bounds", low_N)
        n = low.size
        high = _vector("upper bounds", high_N, n)
        wanted = 0.5 * (low + high) if wanted_N is None else _vector("wanted_N", wanted_N, n)
        self._bounds = np.array([low, high, wanted])
        self.low, self.high, self.wanted = self._bounds
        self.wrench_scale = _vector("wrench_scale", wrench_scale)
        directions = self.wrench_scale.size
        if not 1 <= directions <= n:
            raise TensionError(f"{n} cables, {directions} directions; allowed: 1 to {n} directions")
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
        self._directions, self._cables, size = directions, n, max(n, 8)
        self._scaled, self._space = np.zeros((directions, n + 1)), np.zeros((n + 1, n))
        self._scratch = np.zeros((4, size, size))

    def solve(self, W: FloatArray, w_e: FloatArray, t_out: FloatArray) -> TensionOutcome:
        """Write the tensions (n,) for W (d, n) and w_e (d,) into `t_out`.

        All are float64 in C order: another layout is compiled anew where it first comes. `missing`,
        `limiting_cable` and `limiting_bound` then belong to these tensions.
        """
        if t_out.size != self._cables:
            return _REFUSED
        rank = null_space(
            W, w_e, self.wrench_scale, self._bounds, self._scaled, self._space, self._scratch
        )
        if rank < 0:
            return _REFUSED
        outcome = self._choose(self._cables - rank, t_out)
        self._limit = nearest_wrench(
            self._scaled, self._bounds, self.wrench_scale,
            outcome is not _NEAREST, t_out, self.missing, self._scratch,
        )  # fmt: skip
        if rank < self._directions:
            return _SINGULAR
        if self._limit != NO_LIMIT:
            return _NEAREST
        return _FEASIBLE if outcome is _NEAREST else outcome

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

    @abstractmethod
    def _choose(self, null_directions: int, t: FloatArray) -> TensionOutcome:
        """Write tensions t0 + N' lambda within bounds into `t`; NEAREST where there are none."""


class MinimumDeviation(TensionSolver):
    """The tensions within bounds nearest to wanted ones; continuous in W, w_e and bounds."""

    def _choose(self, null_directions: int, t: FloatArray) -> TensionOutcome:
        found = project(self._space, null_directions, self._bounds, t, self._scratch)
        return _FEASIBLE if found else _NEAREST


class ClosedForm(TensionSolver):
    """Pott's closed form about the wanted tensions; where it finds none, those nearest to them.

    Continuous but where the cable changes that it puts on a bound, and where it finds none.
    """

    def _choose(self, null_directions: int, t: FloatArray) -> TensionOutcome:
        if closed_form(self._space, null_directions, self._bounds, t, self._scratch):
            return _FEASIBLE
        found = project(self._space, null_directions, self._bounds, t, self._scratch)
        return _SUBSTITUTED if found else _NEAREST


class PolygonPoint(TensionSolver):
    """A point of the polygon of all tensions within bounds, with at most two null directions.

    The least sum (1-norm) is at a vertex, which changes by steps; the least sum of squares (2-norm)
    and the centroid are continuous.
    """

    def __init__(
        self,
        low_N: FloatArray,
        high_N: FloatArray,
        wrench_scale: FloatArray,
        point: int,
    ) -> None:
        """Take which `point`: ONE_NORM, TWO_NORM or CENTROID of `tension_polygon`."""
        super().__init__(low_N, high_N, wrench_scale)
        directions, n = self._directions, self._cables
        if n > directions + 2:
            raise TensionError(
                f"{n} cables, {directions} directions; allowed: at most {directions + 2} cables, "
                "whose tensions within bounds are a polygon"
            )
        self._point = point

    def _choose(self, null_directions: int, t: FloatArray) -> TensionOutcome:
        space, bounds = self._space, self._bounds
        if not project(space, null_directions, bounds, t, self._scratch):
            return _NEAREST
        if choose(space, null_directions, bounds, self._point, t, self._scratch):
            return _FEASIBLE
        return _SUBSTITUTED


_POINTS = {"polygon-1-norm": ONE_NORM, "polygon-2-norm": TWO_NORM, "polygon-centroid": CENTROID}
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
    if (method == "minimum-deviation") != (wanted_N is not None):
        raise TensionError(f"wanted tensions for {method}; allowed: with minimum-deviation, only")
    if method == "minimum-norm":
        wanted_N = np.zeros(np.size(low_N))
    if wanted_N is not None:
        return MinimumDeviation(low_N, high_N, wrench_scale, wanted_N)
    if method == "closed-form":
        return ClosedForm(low_N, high_N, wrench_scale)
    if method in _POINTS:
        return PolygonPoint(low_N, high_N, wrench_scale, _POINTS[method])
    raise TensionError(f"method {method!r} of tension distribution; allowed: {', '.join(METHODS)}")


def _vector(name: str, value: FloatArray, size: int | None = None) -> FloatArray:
    vector = np.array(value, float)
    if vector.ndim != 1 or vector.size != (vector.size if size is None else size):
        raise TensionError(f"{name} of shape {vector.shape}; allowed: ({size or 'n'},)")
    if not np.isfinite(vector).all():
        raise TensionError(f"{name} {vector}; allowed: finite numbers")
    return vector
