"""Identified parameters of a robot's geometry: their names, and prior knowledge of them.

A vector of parameters contains, for each cable in turn, the identified ones of `CABLE_KINDS`, then
the elongation if it is identified. Each is added to the value of the robot's file.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Final, Literal, Self

import numpy as np

from cdpr_profiles import Robot
from cdpr_profiles.platform import NO_PLATFORM
from cdpr_profiles.robot import default_name
from cdpr_rt.arrays import FloatArray
from cdpr_rt.errors import InvalidRequestError
from cdpr_rt.model.cable_kernel import ANCHOR, RADIUS
from cdpr_rt.model.kinematics import SPATIAL
from cdpr_rt.model.platform_model import PlatformModel, platform_model_of

ParameterKind = Literal["exit", "offset", "drum", "anchor", "pulley", "elongation"]
KINDS: Final[tuple[ParameterKind, ...]] = (
    "exit",
    "offset",
    "drum",
    "anchor",
    "pulley",
    "elongation",
)
USUAL: Final[tuple[ParameterKind, ...]] = ("exit", "offset", "drum", "elongation")
_ROWS: Final[dict[ParameterKind, tuple[int, ...]]] = {
    "exit": (0, 1, 2), "offset": (3,), "drum": (4,), "anchor": (5, 6, 7), "pulley": (8,),
}  # fmt: skip
CABLE_ROWS: Final = 9
"""Parameters that a cable can have: exit point (3), offset, drum, anchor point (3), pulley."""
EXIT, OFFSET, DRUM, ANCHORS, PULLEY = slice(0, 3), 3, 4, slice(5, 8), 8


@dataclass(frozen=True)
class Knowledge:
    """Prior standard deviations of the file's geometry and of readings."""

    exit_m: float = 0.05
    """Standard deviation of each coordinate of an exit point: a tape measure's."""
    offset_m: float = 0.2
    """Standard deviation of a cable's length when the encoders began to count."""
    drum: float = 0.005
    """Relative standard deviation of the cable paid out per motor turn."""
    anchor_m: float = 0.002
    pulley_m: float = 0.003
    elongation: float = 0.5
    """Relative standard deviation of the elongation under tension."""
    length_m: float = 0.0003
    """Standard deviation of a cable length from the encoder, independent at each pose."""
    length_known: bool = False
    """Whether `length_m` is known; otherwise the readings may increase it."""
    tension_N: float = 3.0
    """Standard deviation of a tension from the motor's torque, due to dry friction."""
    yielding: float = 1.0
    """Factor on the file's elongation for the uncertainty of lengths due to noise of tensions."""
    slope_noise: float = 0.0
    """Spurious information about the elongation due to noise of tensions, per pose, which the fit
    subtracts; see `cdpr_rt.calibration.fit`."""
    alike: float = 1.0
    """Number of successive readings that together count as one, because they have the same
    error."""
    aim_rad: float = math.inf
    """Standard deviation of the platform's rotation about its target; inf if targets are not
    used."""
    loose_drum: float | None = None
    """Replaces `drum` if readings show that the file's drums are wrong."""

    def of_cable(self) -> FloatArray:
        """Return the standard deviations of a cable's parameters, (9,)."""
        anchors = [self.anchor_m] * 3
        drum = self.drum if self.loose_drum is None else self.loose_drum
        rows = [*[self.exit_m] * 3, self.offset_m, drum, *anchors, self.pulley_m]
        return np.array(rows)


@dataclass(frozen=True)
class CableGeometry:
    """A robot's geometry with the identified parameters at their present values.

    `cable` (n, 9) and `elongation` are added to the file's values; all lengths in m, drum and
    elongation relative.
    """

    model: PlatformModel
    compliance_1_N: FloatArray
    """1/EA of each cable from the file, (n,), 0 for rigid cables."""
    weight_N_m: FloatArray
    identified: tuple[ParameterKind, ...] = USUAL
    knowledge: Knowledge = field(default_factory=Knowledge)
    cable: FloatArray = field(default_factory=lambda: np.zeros((0, CABLE_ROWS)))
    elongation: float = 0.0
    cable_names: tuple[str, ...] = ()
    """Names of the cables' axes in the robot's file, "" for unnamed axes; empty if all are
    unnamed."""

    @classmethod
    def of(
        cls, robot: Robot, identified: Iterable[str] = USUAL, knowledge: Knowledge | None = None
    ) -> Self:
        """Return the geometry of a robot's file.

        Elongation is not identified if the file models the cables as rigid. Raises
        InvalidRequestError if there is no platform.
        """
        if robot.platform is None:
            raise InvalidRequestError(f"{robot.path}: {NO_PLATFORM}")
        wanted = set(identified)
        if unknown := wanted - set(KINDS):
            allowed = ", ".join(KINDS)
            raise InvalidRequestError(f"identified: {sorted(unknown)[0]!r}; allowed: {allowed}")
        model, n = platform_model_of(robot), len(robot.axes)
        how = robot.platform.cable_model
        cables = [axis.winch.cable for axis in robot.axes]
        soft = np.array([1.0 / cable.stiffness_N for cable in cables]) * (how != "rigid")
        heavy = np.array([cable.weight_per_length_N_m for cable in cables]) * (how == "catenary")
        if how == "rigid":
            wanted -= {"elongation"}
        kinds = tuple(kind for kind in KINDS if kind in wanted)
        start = np.zeros((n, CABLE_ROWS))
        named = tuple(
            "" if axis.name == default_name(i) else axis.name for i, axis in enumerate(robot.axes)
        )
        known = knowledge or Knowledge()
        return cls(model, soft, heavy, kinds, known, start, cable_names=named)

    @property
    def n(self) -> int:
        """Number of cables."""
        return self.model.kinematics.n

    @property
    def coordinates(self) -> int:
        """Number of coordinates of a point."""
        return self.model.positions

    @cached_property
    def free(self) -> tuple[int, ...]:
        """Components of the twist in which poses are estimated, including free angles."""
        directions = self.model.kinematics.directions
        if self.hangs_freely:
            return SPATIAL
        return (*directions, 5) if self.turns_freely else directions

    @property
    def turns_freely(self) -> bool:
        """Whether the platform turns freely in its plane until the tensions exert no moment."""
        return self.model.kinematics.turns_freely

    @property
    def hangs_freely(self) -> bool:
        """Whether the platform hangs in space on too few cables to control its orientation."""
        return self.model.kinematics.hangs_freely

    @property
    def balance_rows(self) -> int:
        """Number of residuals at each pose by which the platform is in equilibrium."""
        return 6 + self.n if self.hangs_freely else int(self.turns_freely)

    @property
    def balance_readings(self) -> int:
        """Number of readings at each pose that the equilibrium replaces."""
        return max(6 - self.n, 0) if self.hangs_freely else int(self.turns_freely)

    @cached_property
    def rows(self) -> tuple[int, ...]:
        """Indices of the identified parameters among the nine of a cable."""
        return tuple(
            row
            for kind in self.identified
            for row in _ROWS.get(kind, ())
            if kind not in ("exit", "anchor") or row - _ROWS[kind][0] < self.coordinates
        )

    @property
    def shared(self) -> int:
        """Number of parameters that all cables share: 1 for the elongation, or 0."""
        return int("elongation" in self.identified)

    @property
    def size(self) -> int:
        """Number of identified parameters."""
        return self.n * len(self.rows) + self.shared

    def values(self) -> FloatArray:
        """Return the vector of parameters, (P,)."""
        return np.append(self.cable[:, self.rows].ravel(), [self.elongation] * self.shared)

    def with_values(self, values: FloatArray) -> CableGeometry:
        """Return the same geometry with other parameters (P,)."""
        cable, rows = self.cable.copy(), self.rows
        cable[:, rows] = values[: self.n * len(rows)].reshape(self.n, len(rows))
        elongation = float(values[-1]) if self.shared else self.elongation
        return replace(self, cable=cable, elongation=elongation)

    def known_std(self) -> FloatArray:
        """Return the prior standard deviations of the parameters, (P,)."""
        each = np.tile(self.knowledge.of_cable()[list(self.rows)], self.n)
        return np.append(each, [self.knowledge.elongation] * self.shared)

    def kernel_geometry(self) -> FloatArray:
        """Return the array that the kernels of the kinematics take, (13, n)."""
        geometry = self.model.kinematics.geometry.copy()
        geometry[:ANCHOR] += self.cable[:, EXIT].T
        geometry[ANCHOR:RADIUS] += self.cable[:, ANCHORS].T
        geometry[RADIUS] = np.maximum(geometry[RADIUS] + self.cable[:, PULLEY], 0.0)
        return geometry

    def compliance(self) -> FloatArray:
        """Return 1/EA of each cable with the identified elongation, (n,)."""
        return self.compliance_1_N * (1.0 + self.elongation)

    def cable_name(self, cable: int) -> str:
        """Return the name of a cable, counted from 0: its axis, or its number."""
        named = self.cable_names[cable] if self.cable_names else ""
        return named or f"cable {cable + 1}"

    def cables_text(self, cable: int, alike: Iterable[int], why: str = "") -> str:
        """Return a cable's name and, in brackets, the cables that may be meant instead, and why."""
        others = ", ".join(map(self.cable_name, alike))
        return self.cable_name(cable) + (f" (or {others}{why})" if others else "")

    def names(self) -> list[str]:
        """Return the name of each parameter: cable, kind, coordinate."""
        axes = "xyz"
        words = [
            *(f"exit point {x}" for x in axes), "length offset", "drum",
            *(f"anchor point {x}" for x in axes), "pulley radius",
        ]  # fmt: skip
        cables = [f"{self.cable_name(i)} {words[row]}" for i in range(self.n) for row in self.rows]
        return cables + ["elongation"] * self.shared
