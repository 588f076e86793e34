"""A simulated motor without a drive."""

from __future__ import annotations

from cdpr_sim_bus.robot.motor import Sample, run
from cdpr_sim_bus.robot.motor_state import MotorArray, MotorRatings, Transmission, build_motor
from cdpr_sim_bus.robot.plant import Plant


class Motor:
    """A motor without a drive: its power stage acts immediately and detects no fault."""

    def __init__(
        self,
        plant: Plant,
        ratings: MotorRatings | None = None,
        transmission: Transmission | None = None,
    ) -> None:
        self.ratings = ratings or MotorRatings()
        self.plant = plant
        self.record: MotorArray = build_motor(plant, self.ratings, transmission)
        self.time_s = 0.0

    def step(self, dt_s: float, kind: int, target: float) -> Sample:
        """Advance by `dt_s` seconds; `kind` and `target` as named in `cdpr_sim_bus.robot.servo`."""
        self.time_s += dt_s
        return Sample(*run(self.record, self.time_s, kind, target))
