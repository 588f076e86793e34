"""Winches: a motor, its drive, a gear, a drum and a cable."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from pydantic import Field

from cdpr_profiles.cable import Cable
from cdpr_profiles.drive import DriveProfile
from cdpr_profiles.motor import Motor
from cdpr_profiles.places import reference
from cdpr_profiles.reader import Profile, one_of

# Bit rates of CiA 301.
BITRATES_bit_s = (10_000, 20_000, 50_000, 125_000, 250_000, 500_000, 800_000, 1_000_000)


class WinchFile(Profile):
    """The file of a winch; motor, drive and cable are names or paths of other profiles."""

    name: str = Field(min_length=1)
    notes: tuple[str, ...] = ()
    motor: str
    drive: str
    cable: str
    gear_ratio: float = Field(ge=0.01, le=1000)
    drum_radius_m: float = Field(ge=0.001, le=10)
    cable_sign: Annotated[int, one_of(-1, 1)] = 1
    encoder_counts_per_turn: int = Field(ge=4, le=2**24)
    node_id: int = Field(ge=1, le=127)
    master_node_id: int = Field(default=127, ge=1, le=127)
    bitrate_bit_s: Annotated[int, one_of(*BITRATES_bit_s)] = 1_000_000
    sync_period_s: float = Field(default=0.001, ge=0.0001, le=1.0)


@dataclass(frozen=True)
class Winch:
    """A winch with the profiles it names.

    `gear_ratio` is motor turns per drum turn. `drum_radius_m` is effective: with belt and rope.
    `cable_sign` is +1 if a positive motor angle pays cable out.
    """

    profile: str
    path: Path
    name: str
    motor: Motor
    drive: DriveProfile
    cable: Cable
    gear_ratio: float
    drum_radius_m: float
    cable_sign: int
    encoder_counts_per_turn: int
    node_id: int
    master_node_id: int
    bitrate_bit_s: int
    sync_period_s: float
    notes: tuple[str, ...] = ()

    @property
    def reference(self) -> str:
        """Reference for `load_winch` from any folder: the winch's name, or its file's path."""
        return reference("winches", self.path)

    @property
    def cable_m_per_motor_rad(self) -> float:
        """Cable paid out per radian of the motor, with its sign."""
        return self.cable_sign * self.drum_radius_m / self.gear_ratio

    @property
    def latency_s(self) -> float:
        """Nominal delay from an angle to the middle of the cycle in which its torque acts."""
        return self.drive.feedback_delay_s + self.drive.torque_delay_s + 1.5 * self.sync_period_s
