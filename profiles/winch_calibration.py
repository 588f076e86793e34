"""The calibration of one winch: motor torque over cable tension."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path
from typing import Literal

from pydantic import Field

from cdpr_profiles.bounded_input import replacing
from cdpr_profiles.errors import ProfileError
from cdpr_profiles.motor_bounds import Faults, MotorBounds, within
from cdpr_profiles.reader import Profile
from cdpr_profiles.winch import Winch


class WinchCalibration(Profile):
    """Winding torque = gain × tension + bias ± (friction + friction_per_N × tension).

    Plus applies while the cable is wound in, minus while it is paid out. Torques are those
    commanded to the drive, so the gain contains the error of the torque constant. Half-widths are
    those of 95 % confidence intervals.
    """

    winch: str
    motor: str
    drive_serial: int
    date: datetime
    method: Literal["masses", "sensors"]
    gain_m: float = Field(gt=0)
    """K_t in Nm of motor torque per N of cable tension (Tremblay, section 3.6.2)."""
    gain_half_width_m: float = Field(ge=0)
    nominal_gain_m: float = Field(gt=0)
    """drum_radius_m / gear_ratio of the winch's profile."""
    bias_Nm: float
    bias_half_width_Nm: float = Field(ge=0)
    friction_Nm: float
    friction_half_width_Nm: float = Field(ge=0)
    friction_per_N_m: float
    friction_per_N_half_width_m: float = Field(ge=0)
    residual_rms_Nm: float = Field(ge=0)
    lowest_tension_N: float
    highest_tension_N: float
    raw_data: tuple[str, ...]

    def faults(self, winch: Winch) -> Faults:
        """Yield (key, problem) for values that are impossible for `winch`."""
        bounds, nominal_m = MotorBounds(winch.motor), abs(winch.cable_m_per_motor_rad)
        if self.motor != winch.motor.model:
            yield "motor", f"value {self.motor!r}; allowed: {winch.motor.model}"
        yield from bounds.tension_gain("gain_m", self.gain_m, nominal_m)
        yield from bounds.winch_friction("bias_Nm", self.bias_Nm)
        yield from bounds.winch_friction("friction_Nm", self.friction_Nm)
        most = self.gain_m
        yield from within("friction_per_N_m", self.friction_per_N_m, -most, most, "m, gain_m")
        strength = winch.cable.breaking_force_N
        of = "N, the cable's breaking force"
        yield from within("highest_tension_N", self.highest_tension_N, 0.0, strength, of)
        of = "N, highest_tension_N"
        yield from within(
            "lowest_tension_N", self.lowest_tension_N, 0.0, self.highest_tension_N, of
        )

    def torque_Nm(self, tension_N: float) -> float:
        """Return the winding torque that balances a tension, without friction."""
        return self.gain_m * tension_N + self.bias_Nm

    def friction_at_Nm(self, tension_N: float) -> float:
        """Return the friction torque at a tension."""
        return self.friction_Nm + self.friction_per_N_m * tension_N

    def to_toml(self) -> str:
        """Return the text of the file."""
        return self.toml_text("Measured tension-to-torque gain and friction of one winch.")

    def save(self, path: Path) -> None:
        """Write the file; raises ProfileError with its name."""
        try:
            with replacing(path) as file:
                file.write(self.to_toml().encode())
        except OSError as error:
            raise ProfileError(path, "", f"cannot be written: {error.strerror}") from None
