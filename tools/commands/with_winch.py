"""The options of all commands about one winch on a bus."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path

from cdpr_drivers.bus import BusUrl
from cdpr_drivers.canopen.network import CanNetwork
from cdpr_profiles import Winch, load_winch
from cdpr_rt.loop.operating import Tolerance
from cdpr_tools.commands import options
from cdpr_tools.commands.options import shares
from cdpr_tools.composition import session
from cdpr_tools.output import Output


@dataclass(frozen=True)
class WinchOnBus:
    """The winch and bus that the options of a command name."""

    profile: Winch
    url: BusUrl
    plant: Path | None
    """Plant file of a simulator that the command starts."""
    out: Output
    yes: bool = False
    safety_io: str | None = None
    watching: session.Watching = session.no_watches

    def network(self) -> AbstractContextManager[CanNetwork]:
        """Join the bus for acyclic work; see `open_network`."""
        return session.open_network(self.profile, self.url, self.out, self.plant)

    def powered(
        self, what: str, tolerance: Tolerance | None = None
    ) -> AbstractContextManager[session.Session]:
        """Ask the user for consent to `what`, then boot the drive; see `open_winch`."""
        session.confirm_motion(self.url, self.yes, what)
        return session.open_winch(
            self.profile,
            self.url,
            self.out,
            self.plant,
            safety_io=self.safety_io,
            watching=self.watching,
            tolerance=tolerance,
        )


@shares
@contextmanager
def with_winch(
    winch: options.WinchArgument,
    bus: options.BusOption,
    plant: options.PlantOption = None,
    as_json: options.JsonOption = False,
) -> Iterator[tuple[WinchOnBus, Output]]:
    """Pass the winch that these options name, and the output, to a command."""
    out = Output(as_json)
    yield WinchOnBus(load_winch(winch), session.open_bus(bus), plant, out), out


@shares
@contextmanager
def with_powered_winch(
    winch: options.WinchArgument,
    bus: options.BusOption,
    plant: options.PlantOption = None,
    safety_io: options.SafetyIoOption = None,
    sensors: options.SensorsOption = None,
    port: options.SensorsPortOption = None,
    yes: options.YesOption = False,
    as_json: options.JsonOption = False,
) -> Iterator[tuple[WinchOnBus, Output]]:
    """Pass the winch that the command energises, and the output, to the command."""
    out, watching = Output(as_json), session.tension_watch(sensors, port)
    yield (
        WinchOnBus(load_winch(winch), session.open_bus(bus), plant, out, yes, safety_io, watching),
        out,
    )
