"""A lockstep simulator in this process, so that one fork copies a whole robot with its drives."""

from __future__ import annotations

import fcntl
import os
import shutil
import socket
import stat
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from itertools import count
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from typing_extensions import Buffer, override

from cdpr_drivers.bus.simbus import in_this_process
from cdpr_drivers.robot.robot_buses import robot_urls
from cdpr_profiles import Robot
from cdpr_sim_bus.bus.hub import Hub
from cdpr_sim_bus.cia402.drive import SimDrive
from cdpr_sim_bus.cia402.fault_bench import FaultBench
from cdpr_sim_bus.clock import ClockMode
from cdpr_sim_bus.errors import RequestError
from cdpr_sim_bus.robot.truth_log import PoseLog
from cdpr_tools.composition.robot_physics import physics_of
from cdpr_tools.composition.simulator import RobotSimulator
from cdpr_tools.errors import BadInputError

_numbers = count()
_MASTER = b"\0cdpr-rt/master/"
_BUFFER_BYTES = 1 << 21


class LocalConnection(socket.socket):
    """A client's end of a connection to a hub; while it waits, the hubs run."""

    hubs: Sequence[Hub] = ()

    @override
    def settimeout(self, value: float | None, /) -> None:
        """Do nothing: an answer comes as soon as the hubs have run."""

    @override
    def recv(self, bufsize: int, flags: int = 0, /) -> bytes:
        while True:
            try:
                return super().recv(bufsize, flags | socket.MSG_DONTWAIT)
            except BlockingIOError:
                self._run(flags)

    @override
    def recv_into(self, buffer: Buffer, nbytes: int = 0, flags: int = 0) -> int:
        while True:
            try:
                return super().recv_into(buffer, nbytes, flags | socket.MSG_DONTWAIT)
            except BlockingIOError:
                self._run(flags)

    def _run(self, flags: int) -> None:
        if flags & socket.MSG_DONTWAIT:
            raise BlockingIOError
        for hub in self.hubs:
            hub.turn(0.0)


class LocalSimulator(RobotSimulator):
    """A simulator in this process, ready from the beginning."""

    local = True
    board = None

    def __init__(self, robot: Robot, plant: Path | None) -> None:
        self._temporary = TemporaryDirectory(prefix="cdpr-campaign-")
        self.folder = Path(self._temporary.name)
        self.truth_log: Path = self.folder / "truth.log"
        self.bus = f"simbus:campaign-{os.getpid()}-{next(_numbers)}"
        self._stack = ExitStack()
        self._ends: list[tuple[socket.socket, socket.socket]] = []
        """Both ends of each connection."""
        body, plants = physics_of(robot, plant, detached=False)
        assert body is not None  # campaigns are for robots with a platform
        drives = [
            SimDrive.for_winch(axis.winch, one, serial=serial, robot=member)
            for serial, (axis, one, member) in enumerate(
                zip(robot.axes, plants, body.members(), strict=True), 1
            )
        ]
        drives[0].record_with(PoseLog(self.truth_log, body))
        self._first_drive = drives[0]
        self.hubs: list[Hub] = []
        urls = robot_urls(robot, [self.bus])
        for bus in robot.buses:
            name, nodes = urls[bus.name].channel, [drives[i] for i in robot.axes_on(bus.name)]
            hub = Hub(nodes, mode=ClockMode.LOCKSTEP, bitrate=bus.bitrate_bit_s, name=name)
            in_this_process[name] = self._connector(hub)
            self._stack.callback(in_this_process.pop, name)
            self._stack.callback(hub.close)
            self.hubs.append(hub)
        for number, hub in enumerate(self.hubs):
            hub.robot_hubs, hub.buses_before = self.hubs, self.hubs[:number]
        FaultBench(drives).connect(self.hubs)

    @override
    def await_ready(self) -> str:
        return ""

    @property
    def sync_count(self) -> int:
        """Number of SYNCs so far, as in the log of the truth."""
        return self._first_drive.sync_count

    @override
    def _ask(self, key: str, value: Any = True) -> Any:
        for hub in self.hubs:
            hub.turn(0.0)
        try:
            return self.hubs[0].requests[key](value)
        except RequestError as error:
            raise BadInputError(str(error)) from error

    @override
    def stop(self) -> None:
        self._stack.close()
        self._temporary.cleanup()

    def _connector(self, hub: Hub) -> Callable[[], socket.socket]:
        def connect() -> socket.socket:
            mine, its = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
            end = LocalConnection(fileno=mine.detach())
            end.hubs = self.hubs
            self._ends.append((end, its))
            hub.attach(its)
            return end

        return connect

    # -- forks

    def before_fork(self) -> None:
        """Process what has been sent, and release the locks of the buses.

        A child has separate connections, and takes the locks if it boots its drives again.
        """
        for hub in self.hubs:
            hub.turn(0.0)
        for descriptor in _descriptors():
            if stat.S_ISSOCK(os.fstat(descriptor).st_mode):
                with socket.socket(fileno=os.dup(descriptor)) as sock:
                    locked = sock.family == socket.AF_UNIX and sock.getsockname()
                if isinstance(locked, bytes) and locked.startswith(_MASTER):
                    with socket.socket(socket.AF_UNIX) as unbound:
                        os.dup2(unbound.fileno(), descriptor, inheritable=False)

    def after_fork(self, folder: Path) -> None:
        """Stop sharing sockets and files with the process that has forked; use `folder` from now.

        Every open file of the present folder is replaced by a copy there.
        """
        for pair in self._ends:
            if pair[0].fileno() >= 0 and pair[1].fileno() >= 0:
                _replace(pair)
        for hub in self.hubs:
            hub.after_fork()
        for descriptor in _descriptors():
            path = Path(f"/proc/self/fd/{descriptor}").readlink()
            if path.is_relative_to(self.folder):
                copy = folder / path.relative_to(self.folder)
                if not copy.exists():
                    copy.parent.mkdir(parents=True, exist_ok=True)
                    shutil.copyfile(path, copy)
                new = os.open(copy, fcntl.fcntl(descriptor, fcntl.F_GETFL) & ~os.O_CREAT)
                os.lseek(new, os.lseek(descriptor, 0, os.SEEK_CUR), os.SEEK_SET)
                os.dup2(new, descriptor, inheritable=False)
                os.close(new)
        self.folder = folder
        self.truth_log = folder / self.truth_log.name


def _descriptors() -> list[int]:
    """Return the open descriptors of this process."""
    found = [int(path.name) for path in Path("/proc/self/fd").iterdir()]
    return [one for one in found if os.path.lexists(f"/proc/self/fd/{one}")]


def _replace(pair: tuple[socket.socket, socket.socket]) -> None:
    """Put a new connection behind the descriptors of both ends, with the same options."""
    made = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    for old, new in zip(pair, made, strict=True):
        new.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _BUFFER_BYTES)
        new.setblocking(old.getblocking())
        os.dup2(new.fileno(), old.fileno(), inheritable=False)
        new.close()
