"""The plant file of a cable robot: the truth about platform, cables and motors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, Field

from cdpr_profiles.errors import value_text
from cdpr_profiles.reader import Profile
from cdpr_profiles.winch import Winch
from cdpr_sim_bus.plant_file import PlantFile
from cdpr_sim_bus.robot.camera_plant import CameraPlant
from cdpr_sim_bus.robot.plant import CoggingTerm, LoadPlant, Plant

Vector = tuple[Annotated[float, Field(ge=-1000.0, le=1000.0)], ...]
_Relative = Annotated[float, Field(ge=-0.5, le=0.5)]
_Share = Annotated[float, Field(ge=0.0, le=0.5)]
_Time_s = Annotated[float, Field(ge=0.05, le=1e6)]
_Angle_deg = Annotated[float, Field(ge=-180.0, le=180.0)]


class PlatformPlant(Profile):
    """The rigid body; errors are relative to the robot's profile."""

    mass_error: _Relative = 0.0
    """Relative error: true mass = that of the profile × (1 + this)."""
    centre_of_mass_m: Annotated[Vector, Field(min_length=2, max_length=3)] | None = None
    """Centre of mass in the platform's frame; by default that of the profile."""
    radius_of_gyration_m: Annotated[float, Field(gt=0.0, le=10.0)] | None = None
    """Radius of gyration about every axis; by default the profile's inertia applies or, without
    one, that of a plate whose corners are the anchor points."""
    air_Ns_m: Annotated[float, Field(ge=0.0, le=1000.0)] = 0.5


class GeometryPlant(Profile):
    """Errors of the true points: a given vector for each cable, plus a random error."""

    exit_errors_m: tuple[Vector, ...] = ()
    anchor_errors_m: tuple[Vector, ...] = ()
    exit_sigma_m: Annotated[float, Field(ge=0.0, le=0.5)] = 0.0
    anchor_sigma_m: Annotated[float, Field(ge=0.0, le=0.1)] = 0.0


class SlipPlant(Profile):
    """A cable that slips through its fastening on the drum, once."""

    cable: Annotated[int, Field(ge=1, le=64)]
    """Number of the cable, counted from 1."""
    at_s: Annotated[float, Field(ge=0.0, le=1e6)]
    """Bus time of the slip."""
    slip_m: Annotated[float, Field(ge=-1.0, le=1.0)]
    """Length by which the slip lengthens the cable."""


class CablesPlant(Profile):
    """The cables and their winches."""

    stiffness_error: _Relative = 0.0
    """Relative error: true EA = that of the cable's profile × (1 + this)."""
    damping_s: Annotated[float, Field(ge=0.0, le=0.05)] | None = None
    """Ratio of damping to stiffness; by default that of the cable's profile."""
    creep_shares: tuple[_Share, _Share] = (0.01, 0.01)
    """Creep strain as a share of the elastic strain: a fast part and a slow part."""
    creep_times_s: tuple[_Time_s, _Time_s] = (0.5, 60.0)
    """Time after which 63 % of each part has occurred."""
    sag: bool = True
    """Whether cables have weight."""
    drum_radius_errors: tuple[_Relative, ...] = ()
    """Relative errors of the drum radii: one for each axis, or empty."""
    drum_radius_sigma: Annotated[float, Field(ge=0.0, le=0.1)] = 0.0
    winch_friction_Nm: Annotated[float, Field(ge=0.0, le=100.0)] = 0.0
    """Dry friction of gear and drum without tension, on the motor side."""
    friction_share: Annotated[float, Field(ge=0.0, le=0.9)] = 0.02
    """Further dry friction, as a share of the torque that the tension exerts."""
    slips: Annotated[tuple[SlipPlant, ...], Field(max_length=64)] = ()


class WindingPlant(Profile):
    """Winding of the cables on their drums, guided by carriages that move along the drums."""

    run_out_m: Annotated[float, Field(ge=0.0, le=0.01)] = 3e-5
    """Eccentricity of a drum: amplitude of the variation of cable length once a turn."""
    pitch_m: Annotated[float, Field(ge=0.0, le=0.2)] = 0.006
    """Distance from one turn on the drum to the next."""
    carriage_error: Annotated[float, Field(ge=0.0, le=1.0)] = 0.02
    """Share of the drum's advance by which a carriage lags behind; 1: it does not move."""
    carriage_offset_m: Annotated[float, Field(ge=-0.5, le=0.5)] = 0.002
    """Offset of the carriage from its cable at power-up."""
    carriage_distance_m: Annotated[float, Field(gt=0.0, le=10.0)] = 0.3
    """Distance of the carriage from the drum."""
    gear_stiffness_Nm_rad: Annotated[float, Field(ge=100.0, le=1e9)] = 10_000.0
    """Stiffness of gear and belt, at the drum."""


def _one_or_each(value: Any) -> Any:
    return value if isinstance(value, tuple) else (value,)


_Slack_m = Annotated[float, Field(ge=0.0, le=10.0)]


class StartPlant(Profile):
    """State of the robot at power-up."""

    position_m: Vector | None = None
    """Position of the platform's origin; by default the profile's home."""
    angle_deg: _Angle_deg | None = None
    """Angle of a platform in a plane; by default that of the profile at home."""
    rotation_deg: Annotated[tuple[_Angle_deg, ...], Field(min_length=3, max_length=3)] | None = None
    """Rotation vector of a platform in space; by default that of the profile at home."""
    slack_m: Annotated[tuple[_Slack_m, ...], Field(min_length=1), BeforeValidator(_one_or_each)] = (
        0.02,
    )
    """Slack: one value for every cable (a number in the file), or one for each."""


class FloorPlant(Profile):
    """The floor under the platform."""

    height_m: Annotated[float, Field(ge=-1000.0, le=1000.0)] | None = None
    """Height of the floor; by default the platform stands on it at rest in its pose at power-up."""
    present: bool = True
    stiffness_N_m: Annotated[float, Field(gt=0.0, le=1e7)] = 1e6
    damping_Ns_m: Annotated[float, Field(ge=0.0, le=1e5)] = 500.0
    friction: Annotated[float, Field(ge=0.0, le=2.0)] = 0.3


class VariationPlant(Profile):
    """Differences between the motors and the one in [motor], uniform within ± these values."""

    cogging: Annotated[float, Field(ge=0.0, le=0.9)] = 0.2
    """Relative variation of each amplitude; phases are random."""
    friction: Annotated[float, Field(ge=0.0, le=0.9)] = 0.2
    torque_constant: Annotated[float, Field(ge=0.0, le=0.3)] = 0.03


class ScannerPlant(Profile):
    """An external device that measures the platform's pose, if there is one."""

    position_sigma_m: Annotated[float, Field(ge=0.0, le=0.1)] = 0.002
    """Standard deviation of each coordinate."""
    rotation_sigma_rad: Annotated[float, Field(ge=0.0, le=0.1)] = 0.002
    """Standard deviation of each component of the rotation error, a rotation vector."""
    rate_Hz: Annotated[float, Field(gt=0.0, le=1000.0)] = 10.0


class RobotPlant(PlantFile):
    """All sections of a robot's plant file; every key has a default.

    `motor` is the plant of one motor, as for a single winch. `motors`, if given, has one per motor.
    """

    seed: Annotated[int, Field(ge=0, lt=2**32)] = 7
    platform: PlatformPlant = PlatformPlant()
    geometry: GeometryPlant = GeometryPlant()
    cables: CablesPlant = CablesPlant()
    winding: WindingPlant = WindingPlant()
    start: StartPlant = StartPlant()
    floor: FloorPlant = FloorPlant()
    variation: VariationPlant = VariationPlant()
    scanner: ScannerPlant = ScannerPlant()
    camera: CameraPlant = CameraPlant()
    """The camera on the platform, if the robot is simulated with one."""
    motor: Plant = Plant()
    motors: tuple[Plant, ...] = ()

    def require_fit(self, n: int, size: int) -> None:
        """Raise ValueError if the plant does not fit a robot of n axes and 2 or 3 directions."""
        geometry = self.geometry
        errors = {
            "geometry.exit_errors_m": geometry.exit_errors_m,
            "geometry.anchor_errors_m": geometry.anchor_errors_m,
        }
        slack_m = self.start.slack_m
        for_each = {
            **errors,
            "cables.drum_radius_errors": self.cables.drum_radius_errors,
            "start.slack_m": slack_m if len(slack_m) > 1 else (),
            "motors": self.motors,
        }
        for key, values in for_each.items():
            if values and len(values) != n:
                raise ValueError(f"{key}: {len(values)} entries; allowed: {n}, one for each axis")
        for k, slip in enumerate(self.cables.slips):
            if slip.cable > n:
                raise ValueError(f"cables.slips[{k}].cable: {slip.cable}; allowed: 1 to {n}")
        points: dict[str, Vector | None] = {
            "platform.centre_of_mass_m": self.platform.centre_of_mass_m,
            "start.position_m": self.start.position_m,
        }
        for key, vectors in errors.items():
            points |= {f"{key}[{i}]": vector for i, vector in enumerate(vectors)}
        for key, point in points.items():
            if point is not None and len(point) != size:
                raise ValueError(f"{key}: value {value_text(point)}; allowed: {size} coordinates")
        if size == 2 and self.start.rotation_deg is not None:
            raise ValueError(
                "start.rotation_deg: allowed only in space; in a plane use start.angle_deg"
            )
        if size == 3 and self.start.angle_deg is not None:
            raise ValueError(
                "start.angle_deg: allowed only in a plane; in space use start.rotation_deg"
            )
        for i, motor in enumerate(self.motors or (self.motor,)):
            if motor.load.model_copy(update={"inertia_kg_m2": 0.0}) != LoadPlant():
                where = f"motors[{i}].load" if self.motors else "motor.load"
                raise ValueError(
                    f"{where}: allowed: only inertia_kg_m2, because the platform is the load"
                )

    def motor_plants(self, n: int, winches: Sequence[Winch] = ()) -> list[Plant]:
        """Return the plant of each of n motors; `winches`, if given, belong to these motors."""
        plants = list(self.motors) or [self.motor] * n
        if winches:
            plants = [plant.of(winch) for plant, winch in zip(plants, winches, strict=True)]
        if self.motors:
            return plants
        rng = np.random.default_rng(self.seed)
        varied = [self._varied(i, base, rng) for i, base in enumerate(plants)]
        return [_turned(plant, rng) for plant in varied]

    def _varied(self, i: int, base: Plant, rng: np.random.Generator) -> Plant:
        by = self.variation

        def varied(share: float) -> float:
            return 1.0 + share * rng.uniform(-1.0, 1.0)

        cogging = tuple(
            CoggingTerm(
                order=term.order,
                amplitude_Nm=term.amplitude_Nm * varied(by.cogging),
                phase_deg=math.degrees(rng.uniform(-math.pi, math.pi)),
                kind=term.kind,
            )
            for term in base.cogging
        )
        rubbing = varied(by.friction)
        friction = base.friction.model_copy(
            update={
                "coulomb_Nm": base.friction.coulomb_Nm * rubbing,
                "breakaway_Nm": base.friction.breakaway_Nm * rubbing,
            }
        )
        error = base.motor.torque_constant_error + by.torque_constant * rng.uniform(-1.0, 1.0)
        index = base.encoder.index_deg + rng.uniform(0.0, 360.0)
        return base.model_copy(
            update={
                "seed": (self.seed + i) % 2**32,
                "cogging": cogging,
                "friction": friction,
                "motor": base.motor.model_copy(update={"torque_constant_error": error}),
                "encoder": base.encoder.model_copy(update={"index_deg": index % 360.0}),
            }
        )


def _turned(plant: Plant, rng: np.random.Generator) -> Plant:
    """Return a plant whose periodic errors (once a turn and more) have random phases."""
    ripple, friction, encoder = rng.uniform(-180.0, 180.0, 3).tolist()
    return plant.model_copy(
        update={
            "ripple": plant.ripple.model_copy(update={"phase_deg": ripple}),
            "friction": plant.friction.model_copy(update={"angle_phase_deg": friction}),
            "encoder": plant.encoder.model_copy(update={"eccentricity_phase_deg": encoder}),
        }
    )
