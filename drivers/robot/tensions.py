"""A robot's tension sensors beside its control loop."""

from __future__ import annotations

from contextlib import ExitStack

from cdpr_drivers.errors import ConfigurationError
from cdpr_drivers.modbus.tension import TensionSampler
from cdpr_profiles import Robot
from cdpr_profiles.devices.tension_sensor import load_tension_sensors
from cdpr_rt.core.clock import Clock
from cdpr_rt.core.tension_feedback import TensionFeedback

_FIRST_READINGS_S = 3.0


class RobotTensions:
    """The load cells of a robot, read beside the cycle for as long as they are open.

    Without a `port` there are none, and tensions are estimated from torques. Raises
    ConfigurationError for a port without sensors to it, and for more sensors than axes.
    """

    def __init__(self, robot: Robot, port: str | None) -> None:
        self._profile, self._port = None, port
        self._sampler: TensionSampler | None = None
        if port is None:
            return
        if robot.tension_sensors is None:
            raise ConfigurationError(
                f"--tension-port {port}: {robot.path} names no sensors (key tension_sensors)"
            )
        self._profile = load_tension_sensors(robot.tension_sensors)

    def open(self, stack: ExitStack, clock: Clock) -> None:
        """Begin to read, until `stack` ends it; raises ModbusError for a sensor that is silent."""
        if self._profile is None or self._port is None:
            return
        self._sampler = stack.enter_context(TensionSampler(self._profile, self._port, clock))
        stack.callback(self._forget)
        self._sampler.await_readings(_FIRST_READINGS_S)

    def _forget(self) -> None:
        self._sampler = None

    def read(self) -> TensionFeedback | None:
        """Return the tensions as last read, None where none are measured; for the cycle."""
        sampler = self._sampler
        if sampler is None:
            return None
        sampler.exchange.update()
        return sampler.exchange.feedback

    def trouble(self) -> str:
        """Return why the tensions cannot be relied on, or an empty text."""
        return "" if self._sampler is None else self._sampler.exchange.reason()

    def missing(self, robot: Robot) -> str:
        """Return what to tell people of sensors that nobody reads, or an empty text."""
        if self._profile is not None or robot.tension_sensors is None:
            return ""
        return f"{robot.tension_sensors} is not read: give --tension-port to have it measure"
