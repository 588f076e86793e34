"""Load cells that watch over a session: too much tension, or none known, brakes the motion."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext

from cdpr_drivers.errors import ConfigurationError
from cdpr_drivers.modbus.tension import TensionSampler
from cdpr_profiles.devices.tension_sensor import load_tension_sensors
from cdpr_rt.core.clock import Clock
from cdpr_rt.core.cycle import Watch
from cdpr_rt.core.tension_feedback import TensionWatch

_FIRST_READINGS_S = 2.0


Watching = Callable[[Clock], AbstractContextManager[Sequence[Watch]]]
"""Opens watches of a session by its clock, for as long as the block runs."""


def no_watches(_: Clock) -> AbstractContextManager[Sequence[Watch]]:
    """Open nothing."""
    return nullcontext(())


def tension_watch(sensors: str | None, port: str | None) -> Watching:
    """Return what opens the tensions as a session's watch, or none without `sensors`.

    Raises ConfigurationError where one of both is missing, and ProfileError; opening them raises
    ModbusError for load cells that do not answer.
    """
    if (sensors is None) != (port is None):
        raise ConfigurationError(
            "--sensors and --tension-port go together: the load cells and their line"
        )
    if sensors is None or port is None:
        return no_watches
    profile = load_tension_sensors(sensors)

    @contextmanager
    def watching(clock: Clock) -> Iterator[Sequence[Watch]]:
        with TensionSampler(profile, port, clock) as sampler:
            sampler.await_readings(_FIRST_READINGS_S)
            yield (TensionWatch(sampler.exchange, profile.stop_above_N),)

    return watching
