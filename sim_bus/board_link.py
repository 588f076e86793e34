"""What ties a simulated drive to its axis on the physics board."""

from __future__ import annotations

from sim_bus import servo
from sim_bus.cia402.axis import Axis
from sim_bus.cia402.machine import Machine
from sim_bus.physics_board import BoardAxis


class BoardLink:
    """Writes the truth about one drive to the board and obeys what others write there."""

    def __init__(self, axis: Axis, machine: Machine, board: BoardAxis) -> None:
        self._axis = axis
        self._machine = machine
        self._board = board
        self._tension = axis.motor["tension"]
        self._brake_Nm = axis.plant.motor.brake_torque_Nm
        self._released = True
        self._mass_kg = axis.read("mass")
        board.hung_mass_kg = self._mass_kg
        self.publish()

    def obey(self) -> None:
        """Take power, brake and mass as the board has them now."""
        board = self._board
        if board.power_allowed != self._machine.power_allowed:
            self._machine.allow_power(board.power_allowed)
        if board.brake_released != self._released:
            self._released = board.brake_released
            self._axis.motor["brake"] = 0.0 if self._released else self._brake_Nm
        if board.hung_mass_kg != self._mass_kg:
            self._mass_kg = board.hung_mass_kg
            self._axis.motor["mass"] = self._mass_kg

    def publish(self) -> None:
        """Write tension and motion as they are now."""
        axis = self._axis
        angle, speed = axis.sample[4], axis.sample[5]
        self._board.publish(
            axis.time, float(self._tension[0]), angle, speed, axis.kind != servo.OFF
        )
