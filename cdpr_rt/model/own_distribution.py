"""Tension distributions that users write."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from cdpr_profiles import Robot
from cdpr_profiles.errors import ProfileError, brief
from cdpr_profiles.platform import DISTRIBUTIONS
from cdpr_rt.arrays import FloatArray, read_only, real_array
from cdpr_rt.code_loader import CodeError, load_allowed, load_registered_one, require_allowed
from cdpr_rt.errors import ControlError, error_text
from cdpr_rt.jit import jit

TensionDistribution = Callable[
    [FloatArray, FloatArray, FloatArray, FloatArray, FloatArray], ArrayLike
]
"""`f(W, w, low, high, previous)` returns tensions t (n,), N, with W t + w = 0, low <= t <= high.

`W` (d, n) is the wrench matrix. `w` (d,) is the wrench of all other forces on the platform, N and
Nm, about its origin. `low` and `high` (n,) are the bounds, N. `previous` (n,) are the tensions of
the last cycle, N, at first those of the built-in distribution. The arrays are read-only and
overwritten in each cycle. The function is called only if such tensions exist.
"""

TOLERANCE: Final = 1e-4
"""Allowed distance from a bound, as a share of the span between the bounds; and from equilibrium,
as a share of the largest force among W t and w."""
FADE_S: Final = 0.2
"""Time in which a loop fades from the built-in distribution to the user's."""


class TensionDistributionError(ControlError):
    """The user's tension distribution has failed; the message names it."""


_RIGHT, _NOT_FINITE, _OUTSIDE, _UNBALANCED = range(4)


@jit
def _check(
    W: FloatArray,
    w_e: FloatArray,
    bounds: FloatArray,
    scale: FloatArray,
    t: FloatArray,
    t_out: FloatArray,
) -> tuple[int, int, float]:
    """Check tensions `t` (n,), and write them into `t_out`, clipped to `bounds` (2, n), if valid.

    Returns the kind of error, the cable or direction concerned, and the largest allowed |W t + w_e|
    in that direction.
    """
    d, n = W.shape
    for i in range(n):
        if not np.isfinite(t[i]):
            return _NOT_FINITE, i, 0.0
        slack = TOLERANCE * (bounds[1, i] - bounds[0, i])
        if t[i] < bounds[0, i] - slack or t[i] > bounds[1, i] + slack:
            return _OUTSIDE, i, 0.0
    worst, off, largest = 0, 0.0, 0.0
    for k in range(d):
        total, terms = w_e[k], abs(w_e[k])
        for i in range(n):
            total += W[k, i] * t[i]
            terms += abs(W[k, i] * t[i])
        largest = max(largest, terms / scale[k])
        if abs(total) / scale[k] > off:
            worst, off = k, abs(total) / scale[k]
    if off > TOLERANCE * largest:
        return _UNBALANCED, worst, TOLERANCE * largest * scale[worst]
    for i in range(n):
        t_out[i] = min(max(t[i], bounds[0, i]), bounds[1, i])
    return _RIGHT, 0, 0.0


class OwnDistribution:
    """Calls a `TensionDistribution` and checks its tensions. If it fails, a loop no longer uses it.

    Bounds (n,) are in N. `wrench_scale` (d,) is the size of a wrench in each direction that counts
    as 1 N.
    """

    def __init__(
        self,
        function: TensionDistribution,
        low_N: FloatArray,
        high_N: FloatArray,
        wrench_scale: FloatArray,
        period_s: float = FADE_S,
    ) -> None:
        self._function = function
        self._name = getattr(function, "__name__", type(function).__name__)
        self._bounds_N, self._scale = np.array([low_N, high_N]), wrench_scale
        self._low_N, self._high_N = map(read_only, self._bounds_N)
        self._previous_N, self._found_N = np.zeros((2, low_N.size))
        self._fade_cycles = max(1, round(FADE_S / period_s))
        self._cycle, self._failed = 0, False
        W = np.zeros((wrench_scale.size, low_N.size))  # compiles the kernel before the first cycle
        _check(W, wrench_scale, self._bounds_N, wrench_scale, self._found_N, self._found_N)

    def solve(
        self, W: FloatArray, w_e: FloatArray, previous_N: FloatArray, t_out: FloatArray
    ) -> None:
        """Write the function's tensions (n,) for W (d, n) and w_e (d,) into `t_out`.

        Raises TensionDistributionError if the function raises, or if the tensions are not n finite
        numbers within their bounds and in equilibrium.
        """
        given = read_only(W), read_only(w_e), self._low_N, self._high_N, read_only(previous_N)
        try:
            found = self._function(*given)
        except (Exception, SystemExit) as error:  # the latter must not end the loop's process
            raise self._error(error_text(error)) from error
        try:
            t = np.ascontiguousarray(real_array(found))
        except (TypeError, ValueError):
            raise self._error(self._not_finite(found)) from None
        if t.shape != self._low_N.shape:
            raise self._error(self._not_finite(t))
        fault, i, most = _check(W, w_e, self._bounds_N, self._scale, t, t_out)
        if fault == _NOT_FINITE:
            raise self._error(self._not_finite(t))
        if fault == _OUTSIDE:
            allowed = f"{self._low_N[i]:.6g} to {self._high_N[i]:.6g} N"
            raise self._error(f"returned {t[i]:.6g} N for cable {i + 1}; allowed: {allowed}")
        if fault == _UNBALANCED:
            off = abs(float(W[i] @ t + w_e[i]))
            raise self._error(f"W t + w is {off:.3g} in row {i + 1}; allowed: up to {most:.2g}")

    def _not_finite(self, found: object) -> str:
        array = isinstance(found, np.ndarray)
        shown = np.array2string(np.asarray(found), threshold=10) if array else brief(repr(found))
        return f"returned {shown}; return {self._low_N.size} finite tensions in N"

    def _error(self, what: str) -> TensionDistributionError:
        return TensionDistributionError(f"tension distribution {self._name}: {what}")

    # -- use in a loop

    def restart(self) -> None:
        """Fade from the built-in distribution again."""
        self._cycle = 0

    def stand_in(self) -> None:
        """Use the built-in distribution until `revive` is called."""
        self._failed = True

    def revive(self) -> None:
        """Use the user's function again."""
        self._failed, self._cycle = False, 0

    def write(self, W: FloatArray, w_e: FloatArray, tension_N: FloatArray) -> bool:
        """Replace the built-in tensions (n,) by the user's; return False if they are not used.

        Raises TensionDistributionError, after which the function is not used until `revive`.
        """
        if self._failed:
            return False
        if self._cycle == 0:
            self._previous_N[:] = tension_N
        self._failed = True  # until this cycle succeeds
        self.solve(W, w_e, self._previous_N, self._found_N)
        self._cycle = min(self._cycle + 1, self._fade_cycles)
        # both carry the wrench within the bounds, so any weighted mean of them does too
        tension_N += self._cycle / self._fade_cycles * (self._found_N - tension_N)
        self._previous_N[:] = tension_N
        self._failed = False
        return True


# The distribution that a robot's file names, if it is not built in.


def named_distribution(robot: Robot) -> TensionDistribution | None:
    """Return the distribution that the robot's file names; None if it is a built-in one.

    This runs the code of a file only if the user has allowed it. Raises ProfileError.
    """
    own = "" if robot.platform is None else robot.platform.own_distribution
    if not own:
        return None
    try:
        if ":" in own:
            found = load_allowed(own, robot.path.parent)
        else:
            found = load_registered_one(DISTRIBUTIONS, own)
        return checked_distribution(own, found)
    except ControlError as error:
        raise _refused(robot, error) from error


def require_code_allowed(robot: Robot, *, allow_code: bool) -> None:
    """Raise ProfileError if the robot's file names code that the user has not allowed.

    `allow_code` allows it from now on. No code runs.
    """
    own = "" if robot.platform is None else robot.platform.own_distribution
    if ":" not in own:
        return
    try:
        require_allowed(own, robot.path.parent, allow=allow_code)
    except ControlError as error:
        raise _refused(robot, error) from error


def _refused(robot: Robot, error: ControlError) -> ProfileError:
    return ProfileError(robot.path, "platform.tension_distribution", str(error))


def checked_distribution(reference: str, found: Any) -> TensionDistribution:
    """Return `found` if it is callable; otherwise raise CodeError that begins with `reference`."""
    if not callable(found) or isinstance(found, type):
        shown = getattr(found, "__name__", None) or repr(found)[:60]
        raise CodeError(f"{reference}: {shown} is not a function f(W, w, low, high, previous)")
    function: TensionDistribution = found
    return function
