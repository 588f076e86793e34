"""Interface of a procedure to the winch that it measures, and to the user."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any, Protocol

from cdpr_profiles import Winch
from cdpr_rt.identification.cogging_profile import DriveIdentity
from cdpr_rt.runtime.operating import Operator


class Notifier(Protocol):
    """Is told how a procedure goes on."""

    def note(self, text: str) -> None:
        """Take a line on what is going on."""

    def progress(
        self, what: str, total_s: float
    ) -> AbstractContextManager[Callable[[float], None]]:
        """Return what is called with the seconds of bus time that are done, of `total_s`."""


@dataclass(frozen=True)
class Tolerance:
    """Limits of a motion in a procedure; a bare rotor may swing by turns without harm."""

    following_error_rad: float = 4.0 * math.tau
    speed_rad_s: float | None = None
    """A share of each motor's rated speed where left out."""


class BootedDrive(Protocol):
    """Data of a drive from its boot."""

    device_name: str
    rated_torque_Nm: float
    counts_per_turn: int
    changed: list[str]
    """Objects that were written since they differed."""
    absent: list[str]
    """Objects that were to be set and are not there."""


class WinchOperator(Operator, ABC):
    """Operates the loop of one winch, whose drive and bus are known to the derived class."""

    @property
    @abstractmethod
    def winch(self) -> Winch:
        """The winch."""

    @property
    @abstractmethod
    def boot(self) -> BootedDrive:
        """Data of its drive from the boot."""

    @property
    @abstractmethod
    def drive_identity(self) -> DriveIdentity:
        """Identity of drive and encoder, to which a cogging profile is bound besides the motor."""

    @property
    @abstractmethod
    def torque_step_Nm(self) -> float:
        """The smallest difference of torque that its drive can be told."""

    @property
    @abstractmethod
    def is_simulated(self) -> bool:
        """Whether no real motor turns."""

    @abstractmethod
    def find_index(self) -> None:
        """Find the encoder index by homing, which turns the motor by up to a turn; no power then.

        The drive is in its torque mode again.
        """

    @abstractmethod
    def expect_index(self) -> None:
        """Have the drive latch its index in the ordinary motion that follows."""

    @abstractmethod
    def sync_offset(self) -> int:
        """Return how many SYNCs a simulated bus had seen before the first cycle."""

    @abstractmethod
    def bus_record(self) -> dict[str, Any]:
        """Return the bus for reports: url, missed answers, load where that is known."""

    @property
    def identity(self) -> dict[str, Any]:
        """Origin of raw data: winch, motor, drive."""
        whose = {"winch": self.winch.reference, "motor": self.winch.motor.model}
        return whose | self.drive_identity.model_dump()
