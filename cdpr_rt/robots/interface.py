"""What the controller asks of a robot, whatever its cables and directions."""

from __future__ import annotations

from typing import Protocol

from cdpr_rt.arrays import BoolArray, FloatArray
from cdpr_rt.control.base import Controller
from cdpr_rt.core.exchange import AxisFeedback


class PlatformControl(Controller, Protocol):
    """A controller whose set-point is a platform's, in the coordinates of its robot's file.

    As a `Controller` it writes the axes' set-points itself, so that others may go on from there.
    Positions, velocities and accelerations are (d,), one for each controlled direction: coordinates
    of the origin, m, and the rotation vector from the orientation at home, rad. Tensions and
    lengths are (n,).
    """

    position: FloatArray
    """The set-point, to be written along with its derivatives."""
    velocity: FloatArray
    acceleration: FloatArray
    shaped: FloatArray
    """The set-point's position as the control follows it."""
    tension_N: FloatArray
    """The tensions of the last cycle."""
    least_N: FloatArray
    """The lowest tensions allowed."""
    low_N: FloatArray
    """The lowest tensions that are planned with."""
    torque_Nm: FloatArray
    """What the motors may be asked for."""
    estimated: FloatArray
    """Where the platform is, (d,)."""
    residual_m: float
    """How far the cables' lengths are from agreeing with each other, root mean square."""

    @property
    def inertia_kg_m2(self) -> FloatArray:
        """Of each motor, (n,)."""

    @property
    def pose(self) -> FloatArray:
        """Where the platform is, (7,): x y z, quaternion w x y z."""

    @property
    def swing_rad(self) -> float:
        """By how much a platform that no cable keeps from turning may swing to and fro; else 0."""

    @property
    def swing_m(self) -> float:
        """By how much an anchor point of such a platform may swing to and fro; else 0."""

    @property
    def free_lengths_m(self) -> FloatArray:
        """Lengths of the cables without tension, as the motors' angles have them."""

    @property
    def learnt_Nm(self) -> FloatArray | None:
        """Friction and cogging of each motor as learnt in motion, (2, n); None: nothing is."""

    def forget_motors(self) -> None:
        """Forget what was learnt of the motors, as where their encoders have begun anew."""

    def measure_tensions(self, tension_N: FloatArray, measured: BoolArray) -> None:
        """Hold the cables' tensions by readings (n,), kept up to date by others, where valid."""

    @property
    def load_cell_fault(self) -> str:
        """Which load cell is off and by how much, an empty text for none; kept once it is told."""

    def clear_load_cell_fault(self) -> None:
        """Forget which load cell was off."""

    def begin(self, feedback: AxisFeedback) -> None:
        """Take the motors to stand where they are, and the platform where its cables have it."""

    def observe(self, feedback: AxisFeedback) -> None:
        """Bring the estimate of the platform's pose up to date, by one cycle."""

    def clear_compensation(self) -> None:
        """Have it said that nothing is added, while a program drives the winches itself."""

    def stand_still(self, *, on_stand: bool = False) -> None:
        """Have the set-point stand where the platform is, which may rest `on_stand`."""

    def lengths_at_home(self, tension_N: FloatArray) -> FloatArray:
        """Return the lengths without tension of cables that hold `tension_N` at home."""

    def take_lengths(self, length_m: FloatArray, feedback: AxisFeedback) -> None:
        """Take the cables to have these lengths without tension at the motors' angles."""

    def tension_infeasibility(self) -> str:
        """Return why the last cycle's tensions are not feasible, an empty text where they are."""

    def is_feasible(self, position: FloatArray) -> bool:
        """Return whether the platform can be held, and accelerated, at a position."""

    def contact_ahead(self, position: FloatArray) -> int:
        """Return a pair of things in contact on a short straight way from the set-point, -1: none.

        Cables, platform and boxes of the frame, by the clearance of the robot's file; what is in
        contact at the set-point already may leave.
        """

    def contact_at(self, position: FloatArray) -> int:
        """Return a pair of things in contact at a position, nearer than at the set-point."""

    def contact(self, pair: int) -> str:
        """Return in words that a pair is in contact."""

    def infeasibility(self, position: FloatArray) -> str:
        """Return why the platform cannot stand at a position, an empty text where it can."""

    def way_infeasibility(self, position: FloatArray, start: FloatArray | None = None) -> str:
        """Return what is in the straight way to a position, from where it is or from `start`."""
