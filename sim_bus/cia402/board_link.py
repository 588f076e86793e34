"""Connects a simulated drive to its axis on the physics board."""

from __future__ import annotations

from cdpr_sim_bus.cia402.axis import Axis
from cdpr_sim_bus.cia402.state_machine import StateMachine
from cdpr_sim_bus.physics_board import BoardAxis
from cdpr_sim_bus.robot import servo


class BoardLink:
    """Publishes one drive's true state on the board and applies what other devices write there."""

    def __init__(self, axis: Axis, state_machine: StateMachine, board: BoardAxis) -> None:
        self._axis = axis
        self._state_machine = state_machine
        self._board = board
        self._tension = axis.motor["tension"]
        self._brake_Nm = axis.plant.motor.brake_torque_Nm
        self._released, self._power_on = True, False
        self._applied_s = axis.time
        self._mass_kg = axis.read("mass")
        board.hung_mass_kg = self._mass_kg
        self.publish()

    def apply_inputs(self, now_s: float) -> None:
        """Take power, brake and mass as the board has them at bus time `now_s`."""
        board = self._board
        self._applied_s = now_s
        power, released = board.allows_power(now_s), board.releases_brake(now_s)
        if power != self._state_machine.power_allowed:
            self._state_machine.allow_power(power)
        if released != self._released:
            self._released = released
            self._axis.motor["brake"] = 0.0 if self._released else self._brake_Nm
        if board.hung_mass_kg != self._mass_kg:
            self._mass_kg = board.hung_mass_kg
            self._axis.motor["mass"] = self._mass_kg

    def next_change_s(self) -> float:
        """Return the next bus time at which power or brake change."""
        return self._board.next_change_s(self._applied_s)

    def publish(self) -> None:
        """Write tension and motion as they are now."""
        axis = self._axis
        angle, speed = axis.sample[4], axis.sample[5]
        self._power_on = axis.kind != servo.OFF
        shown_N = float(self._tension[0]) + axis.cell_off_N
        self._board.publish(axis.time, shown_N, angle, speed, self._power_on)

    def publish_power(self) -> None:
        """Publish where power has changed, as bus time may stand still for long afterwards."""
        if self._power_on != (self._axis.kind != servo.OFF):
            self.publish()
