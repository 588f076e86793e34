"""The plant file: the truth about one simulated drive and motor, which no controller may read."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self, TypeVar

from pydantic import Field, model_validator

from cdpr_profiles.reader import Profile
from cdpr_profiles.winch import Winch
from cdpr_sim_bus.plant_file import PlantFile

MAX_COGGING_TERMS = 32
_RATED_Nm, _PEAK_Arms = 3.00, 22.8
"""Ratings of the motor MPP0923D, to which the default values belong."""
_Angle_deg = Annotated[float, Field(ge=-1e6, le=1e6)]
_Section = TypeVar("_Section", bound=Profile)


class MotorPlant(Profile):
    """Errors and start state of the rotor and of the torque constant."""

    torque_constant_error: Annotated[float, Field(ge=-0.5, le=0.5)] = 0.04
    """Relative error: true torque constant = nominal × (1 + this)."""
    inertia_kg_m2: Annotated[float, Field(ge=1e-6, le=10.0)] = 1.130e-4
    initial_angle_deg: Annotated[float, Field(ge=-36000.0, le=36000.0)] = 0.0
    """Mechanical angle at power-up; the encoder counts from zero there."""
    brake_torque_Nm: Annotated[float, Field(gt=0.0, le=1000.0)] = 8.0
    """Torque of the holding brake, which is released unless a physics board applies it."""


class CoggingTerm(Profile):
    """One harmonic of the cogging."""

    order: Annotated[int, Field(ge=1, le=2000)] = 4
    """Periods per motor turn."""
    amplitude_Nm: Annotated[float, Field(ge=0.0, le=100.0)] = 0.06
    phase_deg: Annotated[float, Field(ge=-360.0, le=360.0)] = 17.0
    kind: Literal["torque", "current_offset"] = "torque"


class RipplePlant(Profile):
    """Torque ripple that grows with the current, 6 and 12 times per electrical turn.

    Torque = torque constant x current x (1 + sixth sin(x) + twelfth sin(2 x)) with
    x = 6 pole_pairs angle + phase.
    """

    pole_pairs: Annotated[int, Field(ge=1, le=500)] = 4
    sixth: Annotated[float, Field(ge=0.0, le=0.2)] = 0.005
    """Share of the torque."""
    twelfth: Annotated[float, Field(ge=0.0, le=0.2)] = 0.0025
    phase_deg: Annotated[float, Field(ge=-360.0, le=360.0)] = 25.0


class FrictionPlant(Profile):
    """LuGre friction with a Stribeck curve."""

    coulomb_Nm: Annotated[float, Field(ge=0.0, le=100.0)] = 0.08
    breakaway_Nm: Annotated[float, Field(ge=0.0, le=200.0)] = 0.10
    """At least `coulomb_Nm`. If only `coulomb_Nm` is given, 1.25 times that value."""
    stribeck_rad_s: Annotated[float, Field(ge=1e-4, le=100.0)] = 0.2
    viscous_Nms_rad: Annotated[float, Field(ge=0.0, le=10.0)] = 5e-4
    sigma0_Nm_rad: Annotated[float, Field(gt=0.0, le=1e6)] = 20.0
    """Stiffness of the bristles."""
    sigma1_Nms_rad: Annotated[float, Field(ge=0.0, le=100.0)] = 0.02
    """Damping of the bristles."""
    direction_asymmetry: Annotated[float, Field(ge=-1.5, le=1.5)] = 0.1
    """Relative difference a: forward friction × (1 + a/2), backward × (1 − a/2)."""
    angle_share: Annotated[float, Field(ge=0.0, le=0.9)] = 0.03
    """Amplitude of the dry friction's variation once a turn: × (1 + this · sin(angle + phase))."""
    angle_phase_deg: Annotated[float, Field(ge=-360.0, le=360.0)] = 70.0

    @model_validator(mode="before")
    @classmethod
    def _breakaway_follows_coulomb(cls, data: Any) -> Any:
        if isinstance(data, dict) and "breakaway_Nm" not in data:
            coulomb = data.get("coulomb_Nm")
            if isinstance(coulomb, int | float):
                return {**data, "breakaway_Nm": 1.25 * coulomb}
        return data

    @model_validator(mode="after")
    def _breakaway_not_below_coulomb(self) -> Self:
        if self.breakaway_Nm < self.coulomb_Nm:
            raise ValueError(
                f"breakaway_Nm = {self.breakaway_Nm} must not be below "
                f"coulomb_Nm = {self.coulomb_Nm}"
            )
        return self


class EncoderPlant(Profile):
    """Incremental encoder with one index pulse a turn."""

    counts_per_turn: Annotated[int, Field(ge=16, le=2**26)] = 8192
    index_deg: Annotated[float, Field(ge=-360.0, le=360.0)] = 123.4
    """Mechanical angle of the index pulse."""
    index_present: bool = True
    """Whether there is an index pulse."""
    noise_counts: Annotated[float, Field(ge=0.0, le=1000.0)] = 0.3
    """Standard deviation of the reading before rounding."""
    eccentricity_rad: Annotated[float, Field(ge=0.0, le=0.1)] = 1.5e-4
    """Amplitude of the error once a turn, because the disc is eccentric; zero at the index."""
    eccentricity_phase_deg: Annotated[float, Field(ge=-360.0, le=360.0)] = 50.0
    """Phase of that error at the index."""
    interpolation_error: Annotated[float, Field(ge=0.0, le=0.25)] = 0.02
    """Amplitude of the error once a line (four counts), as a share of the line."""


class DrivePlant(Profile):
    """Delays and thresholds of the drive itself."""

    current_loop_bandwidth_Hz: Annotated[float, Field(ge=10.0, le=5000.0)] = 500.0
    feedback_delay_s: Annotated[float, Field(ge=0.0, le=0.01)] = 0.0005
    """Age of the encoder reading that a SYNC latches."""
    feedback_jitter_s: Annotated[float, Field(ge=0.0, le=0.001)] = 2e-5
    """Variation of that age from one SYNC to the next, uniform within ± this value."""
    mode_display_delay_s: Annotated[float, Field(ge=0.0, le=10.0)] = 0.005
    """Time from writing 6060h until the mode acts and 6061h shows it."""
    enable_delay_s: Annotated[float, Field(ge=0.0, le=10.0)] = 0.002
    """Time from the enable operation command until the state is reached."""
    i2t_time_constant_s: Annotated[float, Field(ge=0.01, le=1000.0)] = 10.0
    overcurrent_Arms: Annotated[float, Field(gt=0.0, le=1000.0)] = 30.0
    """Current that raises the overcurrent fault."""
    overspeed_ratio: Annotated[float, Field(ge=1.0, le=10.0)] = 1.2
    """Multiple of the maximum motor speed (6080h) that raises the overspeed fault."""
    off_when_pre_operational: bool = False
    """Whether 6007h also acts in NMT state pre-operational; if not, the last torque stays."""


class ThermalPlant(Profile):
    """Warming of an energised drive; the values of the other sections are for the cold drive."""

    cogging_per_K: Annotated[float, Field(ge=-0.01, le=0.01)] = -0.001
    friction_per_K: Annotated[float, Field(ge=-0.01, le=0.01)] = -0.004
    time_constant_s: Annotated[float, Field(ge=1.0, le=1e6)] = 600.0
    rise_K: Annotated[float, Field(ge=0.0, le=80.0)] = 10.0
    """Final temperature rise of an energised drive."""


class LoadPlant(Profile):
    """The load on the motor and on the cable."""

    inertia_kg_m2: Annotated[float, Field(ge=0.0, le=100.0)] = 0.0
    """Inertia of the load on the motor side, rigidly coupled."""
    kind: Literal["none", "hung_mass", "fixed_anchor"] = "none"
    """none: no cable; hung_mass: a mass hangs or stands on the floor; fixed_anchor: a fixed end."""
    mass_kg: Annotated[float, Field(ge=0.0, le=1000.0)] = 5.0
    height_m: Annotated[float, Field(ge=0.0, le=100.0)] = 0.0
    """Height of the mass above the floor at power-up; 0: it stands on the floor."""
    slack_m: Annotated[float, Field(ge=0.0, le=100.0)] = 0.0
    """Slack of the cable at power-up."""
    pretension_N: Annotated[float, Field(ge=0.0, le=1e5)] = 0.0
    """Tension of a fixed cable at power-up."""
    cable_m: Annotated[float, Field(ge=0.01, le=1000.0)] = 3.0
    """Free length of the cable at power-up, which also determines its stiffness from then on."""
    cable_stiffness_N: Annotated[float, Field(ge=1.0, le=1e9)] | None = None
    """Axial stiffness EA; by default that of the cable's profile."""
    cable_damping_s: Annotated[float, Field(ge=0.0, le=1.0)] = 0.002
    """Ratio of the cable's damping to its stiffness."""
    anchor_stiffness_N_m: Annotated[float, Field(ge=1.0, le=1e9)] | None = None
    """Stiffness of a spring between cable and fixed anchor."""
    drum_radius_error: Annotated[float, Field(ge=-0.5, le=0.5)] = 0.0
    """Relative error: true drum radius = that of the winch's profile × (1 + this)."""
    winch_friction_Nm: Annotated[float, Field(ge=0.0, le=100.0)] = 0.0
    """Dry friction of gear and drum without tension, on the motor side."""
    friction_share: Annotated[float, Field(ge=0.0, le=0.9)] = 0.05
    """Further dry friction, as a share of the torque that the tension exerts."""
    gravity_m_s2: Annotated[float, Field(ge=0.0, le=30.0)] = 9.80665

    @model_validator(mode="after")
    def _slack_or_taut(self) -> Self:
        if self.slack_m > 0.0 and (self.pretension_N > 0.0 or self.height_m > 0.0):
            raise ValueError(
                f"slack_m = {self.slack_m} must be 0 if pretension_N or height_m is given"
            )
        return self


class LimitsPlant(Profile):
    """Mechanical angles of the switches, over several turns; None for a switch that is missing."""

    negative_deg: _Angle_deg | None = None
    """Negative limit switch: active below this angle."""
    positive_deg: _Angle_deg | None = None
    """Positive limit switch: active above this angle."""
    home_from_deg: _Angle_deg | None = None
    home_to_deg: _Angle_deg | None = None
    """Home switch: active between the two angles; with only one, on the whole side beyond it."""

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        for low, high in (("negative_deg", "positive_deg"), ("home_from_deg", "home_to_deg")):
            a, b = getattr(self, low), getattr(self, high)
            if a is not None and b is not None and a >= b:
                raise ValueError(f"{low} = {a} must be below {high} = {b}")
        return self


def _filled(section: _Section, values: dict[str, float]) -> _Section:
    """Return a section with `values` for the keys that its file does not give."""
    left_out = {k: v for k, v in values.items() if k not in section.model_fields_set}
    return section.model_copy(update=left_out)


class Plant(PlantFile):
    """All sections of a plant file; every key has a default."""

    seed: Annotated[int, Field(ge=0, lt=2**32)] = 7
    motor: MotorPlant = MotorPlant()
    cogging: Annotated[tuple[CoggingTerm, ...], Field(max_length=MAX_COGGING_TERMS)] = (
        CoggingTerm(),
    )
    ripple: RipplePlant = RipplePlant()
    friction: FrictionPlant = FrictionPlant()
    encoder: EncoderPlant = EncoderPlant()
    drive: DrivePlant = DrivePlant()
    thermal: ThermalPlant = ThermalPlant()
    load: LoadPlant = LoadPlant()
    limits: LimitsPlant = LimitsPlant()

    def of(self, winch: Winch) -> Plant:
        """Return this plant with omitted values taken from a winch's motor and encoder.

        Inertia, counts and overcurrent come from the profile; cogging and friction scale with
        the rated torque. Values from the file, or from an earlier call, do not change.
        """
        motor = winch.motor
        size = motor.rated_torque_Nm / _RATED_Nm
        current = motor.peak_current_Arms / _PEAK_Arms
        rubbing = ("coulomb_Nm", "breakaway_Nm", "viscous_Nms_rad", "sigma0_Nm_rad")
        friction = _filled(
            self.friction,
            {k: size * getattr(self.friction, k) for k in (*rubbing, "sigma1_Nms_rad")},
        )
        if friction.breakaway_Nm < friction.coulomb_Nm:  # only one of them was given
            friction = friction.model_copy(update={"coulomb_Nm": friction.breakaway_Nm})
        filled: dict[str, object] = {
            "motor": _filled(
                self.motor,
                {
                    "inertia_kg_m2": motor.rotor_inertia_kg_m2,
                    "brake_torque_Nm": size * self.motor.brake_torque_Nm,
                },
            ),
            "ripple": _filled(self.ripple, {"pole_pairs": motor.pole_pairs}),
            "friction": friction,
            "encoder": _filled(self.encoder, {"counts_per_turn": winch.encoder_counts_per_turn}),
            "drive": _filled(
                self.drive, {"overcurrent_Arms": current * self.drive.overcurrent_Arms}
            ),
        }
        if "cogging" not in self.model_fields_set:
            filled["cogging"] = tuple(
                term.model_copy(update={"amplitude_Nm": size * term.amplitude_Nm})
                for term in self.cogging
            )
        return self.model_copy(update=filled)

    @property
    def inertia_kg_m2(self) -> float:
        """Inertia of rotor and load together."""
        return self.motor.inertia_kg_m2 + self.load.inertia_kg_m2
