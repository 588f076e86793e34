"""User-written platform controllers."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from cdpr_rt.arrays import FloatArray, real_array
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
    """Lengths of the cables, (n,), including their stretch, as `Model.lengths` counts them."""
    cable_velocity_m_s: FloatArray
    """Rates of these lengths, from the motors' speeds, (n,)."""
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
    torques: Callable[[FloatArray], FloatArray]
    """Return the torques (n,), Nm, with which the motors exert tensions (n,).

    They include the torques that accelerate the rotors for the target's acceleration.
    """


@dataclass(frozen=True)
class Target:
    """Commanded motion of the platform in this cycle. Arrays are overwritten in each cycle.

    Positions, velocities and accelerations have d entries, as those of `State`.
    """

    position: FloatArray
    """Coordinates in m, then the rotation vector in rad."""
    velocity: FloatArray
    """m/s and rad/s."""
    acceleration: FloatArray
    """m/s2 and rad/s2."""
    cable_length_m: FloatArray
    """Lengths of the cables at this position, (n,)."""
    cable_velocity_m_s: FloatArray
    """Rates of these lengths, (n,)."""


class Controller(ABC):
    """Base class of user-written platform controllers: `update` returns tensions.

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


class TorqueController(Controller):
    """Base class of user-written platform controllers: `update` returns motor torques.

    A positive torque turns its motor to increasing angles. The loop adds the compensation of
    friction and cogging, which recordings show as `compensation_Nm`; they show the returned torques
    as `effort_Nm`. The loop limits the tensions that follow from the torques, as `State.torques`
    relates them, and does not damp cables that pull against each other. All else is as for a
    `Controller`.
    """

    @abstractmethod
    def update(self, state: State, target: Target) -> FloatArray:
        """Return the motor torques of this cycle, (n,), Nm. It must take less than a cycle."""


class OwnController:
    """Calls a `Controller` for the tensions of each cycle, until it fails."""

    def __init__(
        self,
        controller: Controller,
        state: State,
        target: Target,
        last_N: FloatArray,
        tensions_of: Callable[[FloatArray], FloatArray],
    ) -> None:
        """Take the array (n,) behind `state.tension_N`, and the inverse of `state.torques`."""
        self._tensions_of = tensions_of
        self.returns_torques = isinstance(controller, TorqueController)
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

    def write(self, tension_N: FloatArray) -> bool:
        """Replace the built-in controller's tensions (n,); return False if it is not used.

        Raises the errors of the controller, and ValueError if it does not return n finite numbers.
        After an error it writes nothing more.
        """
        if self._failed:
            return False
        self._failed = True  # until this cycle succeeds
        try:
            if self._cycle == 0:
                self._controller.reset(self._state)
            returned = self._controller.update(self._state, self._target)
        except SystemExit as error:  # user code must not end the loop's process
            raise RuntimeError(f"SystemExit: {error}") from error
        try:
            wanted = real_array(returned)
        except (TypeError, ValueError):
            raise self._error(returned) from None
        # the sum is finite only if all numbers are
        if wanted.shape != tension_N.shape or not math.isfinite(wanted.sum()):
            raise self._error(wanted)
        if self.returns_torques:
            wanted = self._tensions_of(wanted)
        bounded = np.minimum(wanted, self._high_N, out=self._bounded_N)
        np.maximum(bounded, self._low_N, out=bounded)
        if self._cycle < self._fade_cycles:
            bounded += (1.0 - self._cycle / self._fade_cycles) * (tension_N - bounded)
            self._cycle += 1
        tension_N[:] = self._last_N[:] = bounded
        self._failed = False
        return True

    def _error(self, returned: object) -> ValueError:
        name = type(self._controller).__name__
        wanted = "motor torques in Nm" if self.returns_torques else "tensions in N"
        with np.printoptions(threshold=10):
            shown = str(returned)[:200]
        return ValueError(
            f"{name}.update returned {shown}; return {self._last_N.size} finite {wanted}"
        )
