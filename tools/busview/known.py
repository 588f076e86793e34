"""The nodes of a bus as a drive's, a winch's or a robot's profile tells them, for decoding."""

from __future__ import annotations

from dataclasses import dataclass, field

from cdpr_drivers.bus import BusUrl
from cdpr_drivers.decode import Decoder, KnownNode
from cdpr_profiles import Robot, load_drive, load_robot, load_winch
from cdpr_tools.errors import BadInputError

_USUAL_BITRATE_bit_s = 1_000_000


@dataclass(frozen=True)
class KnownBus:
    """What is known of a bus before anything was heard."""

    nodes: dict[int, KnownNode] = field(default_factory=dict)
    others: KnownNode | None = None
    bitrate_bit_s: int = _USUAL_BITRATE_bit_s

    def decoder(self) -> Decoder:
        """Return a decoder for a session on this bus."""
        return Decoder(self.nodes, self.others)


def known_bus(
    url: BusUrl | None, drive: str | None, winch: str | None, robot: str | None
) -> KnownBus:
    """Return what the profile that was named tells of a bus; `url` is None for a file's.

    Raises BadInputError, ProfileError.
    """
    if sum(name is not None for name in (drive, winch, robot)) > 1:
        raise BadInputError("--profile, --winch, --robot: one of them says who is on the bus")
    if winch is not None:
        one = load_winch(winch)
        nodes = {one.node_id: KnownNode.of_winch(one)}
        return KnownBus(nodes, bitrate_bit_s=_bitrate(url, one.bitrate_bit_s))
    if robot is not None:
        name, _, bus = robot.partition(":")
        return _of_robot(load_robot(name), bus, url)
    others = None if drive is None else KnownNode(load_drive(drive))
    return KnownBus(others=others, bitrate_bit_s=_bitrate(url, _USUAL_BITRATE_bit_s))


def _bitrate(url: BusUrl | None, otherwise: int) -> int:
    bitrate = url.options.get("bitrate") if url is not None else None
    return bitrate if isinstance(bitrate, int) and bitrate > 0 else otherwise


def _of_robot(robot: Robot, name: str, url: BusUrl | None) -> KnownBus:
    """Return one bus of a robot, or all where no node id says which one is meant."""
    buses = {bus.name: bus for bus in robot.buses}
    if name and name not in buses:
        allowed = " or ".join(f"--robot {robot.reference}:{one}" for one in buses)
        raise BadInputError(f"--robot {robot.reference}:{name}: no such bus; allowed: {allowed}")
    axes = [axis for axis in robot.axes if axis.bus == (name or _bus_at(robot, url) or axis.bus)]
    nodes = {axis.node_id: KnownNode.of_winch(axis.winch) for axis in axes}
    if len(nodes) < len(axes):
        choice = " or ".join(f"--robot {robot.reference}:{one}" for one in buses)
        raise BadInputError(
            f"--robot {robot.reference}: its buses have node ids in common: choose {choice}"
        )
    return KnownBus(nodes, bitrate_bit_s=_bitrate(url, buses[axes[0].bus].bitrate_bit_s))


def _bus_at(robot: Robot, url: BusUrl | None) -> str:
    """Return the name of the robot's bus with this URL, real or simulated; "" if none has it."""
    for bus in robot.buses:
        if url is not None and (bus.url == str(url) or f"-{url.channel}".endswith(f"-{bus.name}")):
            return bus.name
    return ""
