"""User-written platform controllers."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.model.own_distribution import FADE_S


@dataclass(frozen=True)
class State:
    """Input of a controller in a cycle. Arrays are read-only and overwritten in each cycle.

    A position (d,) has one entry for each controlled direction: the coordinates of the platform's
    origin, m, then the rotation vector from the orientation at home, rad. Velocities and wrenches
    have the same directions. There are n cables.
    """

    position: FloatArray
    """Estimated position, (d,)."""
    velocity: FloatArray
    """Estimated twist, (d,), m/s and rad/s."""
    wrench_matrix: FloatArray
    """W (d, n): tensions t exert the wrench W t on the platform, about its origin."""
    wrench: FloatArray
    """Wrench without the cables' tensions if the platform follows the target, (d,), N and Nm.

    It contains gravity, the weight of the cables, and the inertia for the target's acceleration.
    The tensions t carry it if W t + wrench = 0.
    """
    cable_length_m: FloatArray
    """Lengths of the unloaded cables, (n,)."""
    tension_N: FloatArray
    """Tensions of the last cycle, (n,)."""
    low_N: FloatArray
    """Lowest tensions that the robot allows, (n,)."""
    high_N: FloatArray
    """Highest tensions that the robot allows, (n,)."""
    period_s: float
    """Time between two cycles."""
    distribute: Callable[[FloatArray], FloatArray]
    """Return the tensions (n,) that exert a force (d,) in addition to carrying `wrench`.

    The robot's tension distribution computes them. If no such tensions exist within the bounds,
    return those that come nearest.
    """


@dataclass(frozen=True)
class Target:
    """Commanded motion of the platform in this cycle. Arrays (d,) are overwritten in each cycle."""

    position: FloatArray
    """Coordinates in m, then the rotation vector in rad."""
    velocity: FloatArray
    """m/s and rad/s."""
    acceleration: FloatArray
    """m/s2 and rad/s2."""


class Controller(ABC):
    """Base class of user-written platform controllers: subclasses write `update`.

    The controller replaces the built-in one while a platform on tight cables is off its stand. The
    loop fades to it within 0.2 s. The built-in controller still tightens the cables, and brakes and
    lowers the platform in every stop. The loop limits tensions to the robot's bounds. If `update`
    raises, or returns something other than n finite numbers, the loop stops the robot with the
    fault `not_finite`. After a stop, the controller is used again when the cables have been
    tightened.
    """

    def reset(self, state: State) -> None:  # noqa: B027  # optional
        """Reset all internal state, because another controller ran in the last cycle."""

    @abstractmethod
    def update(self, state: State, target: Target) -> FloatArray:
        """Return the tensions of this cycle, (n,), N. It must take less than a cycle."""


class OwnController:
    """Calls a `Controller` for the tensions of each cycle, until it fails."""

    def __init__(
        self, controller: Controller, state: State, target: Target, last_N: FloatArray
    ) -> None:
        """Take the array (n,) behind the read-only view `state.tension_N`."""
        self._controller, self._state, self._target = controller, state, target
        self._failed, self._cycle = False, 0
        self._low_N, self._high_N = state.low_N.copy(), state.high_N.copy()
        self._last_N, self._bounded_N = last_N, np.zeros_like(last_N)
        self._fade_cycles = max(1, round(FADE_S / state.period_s))

    def restart(self, tension_N: FloatArray) -> None:
        """Reset the controller before its next cycle; take the tensions of this cycle, (n,)."""
        self._last_N[:] = tension_N
        self._cycle = 0

    def stand_in(self) -> None:
        """Use the built-in controller until `revive` is called."""
        self._failed = True

    def revive(self) -> None:
        """Use the user's controller again."""
        self._failed, self._cycle = False, 0

    @property
    def in_use(self) -> bool:
        """Whether the controller drives the cables."""
        return not self._failed

    def write(self, tension_N: FloatArray) -> None:
        """Replace the built-in controller's tensions (n,) by those of the user's controller.

        Raises the errors of the controller, and ValueError if it does not return n finite numbers.
        After an error it writes nothing more.
        """
        if self._failed:
            return
        self._failed = True  # until this cycle succeeds
        state = self._state
        try:
            if self._cycle == 0:
                self._controller.reset(state)
            wanted = np.asarray(self._controller.update(state, self._target), float)
        except SystemExit as error:  # user code must not end the loop's process
            raise RuntimeError(f"SystemExit: {error}") from error
        # the sum is finite only if all numbers are
        if wanted.shape != tension_N.shape or not math.isfinite(wanted.sum()):
            name, shown = type(self._controller).__name__, np.array2string(wanted, threshold=10)
            raise ValueError(
                f"{name}.update returned {shown}; return {tension_N.size} finite tensions in N"
            )
        bounded = np.minimum(wanted, self._high_N, out=self._bounded_N)
        np.maximum(bounded, self._low_N, out=bounded)
        if self._cycle < self._fade_cycles:
            bounded += (1.0 - self._cycle / self._fade_cycles) * (tension_N - bounded)
            self._cycle += 1
        tension_N[:] = self._last_N[:] = bounded
        self._failed = False
