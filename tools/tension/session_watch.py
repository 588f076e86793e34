"""Load cells that watch over a session: too much tension, or none known, brakes the motion."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from cdpr_rt.executive import Watch
from cdpr_rt.tension import TensionWatch
from drivers.modbus.tension import TensionSampler
from profiles.tension_sensor import load_tension_sensors
from tools.errors import BadInputError

_FIRST_READINGS_S = 2.0


@contextmanager
def tension_watch(sensors: str | None, port: str | None) -> Iterator[Sequence[Watch]]:
    """Yield what `open_winch` takes as watches: the tensions, or none without `sensors`.

    Raises BadInputError where one of both is missing, ProfileError, and ModbusError for load
    cells that do not answer.
    """
    if (sensors is None) != (port is None):
        raise BadInputError("--sensors and --port go together: the load cells and their line")
    if sensors is None or port is None:
        yield ()
        return
    profile = load_tension_sensors(sensors)
    with TensionSampler(profile, port) as sampler:
        sampler.await_readings(_FIRST_READINGS_S)
        yield (TensionWatch(sampler.exchange, profile.stop_above_N),)
