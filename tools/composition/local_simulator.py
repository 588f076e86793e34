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
from cdpr_sim_bus.bus.server import with_frame_log
from cdpr_sim_bus.cia402.fault_bench import FaultBench
from cdpr_sim_bus.errors import RequestError
from cdpr_tools.composition.robot_physics import frame_log_at, simulated_drives
from cdpr_tools.composition.simulator import next_frame_log
from cdpr_tools.errors import BadInputError

_numbers = count()
_MASTER = b"\0cdpr-rt/master/"
_BUFFER_BYTES = 1 << 21
_DONTWAIT = int(socket.MSG_DONTWAIT)  # arithmetic of enumerations is slow


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
                return super().recv(bufsize, flags | _DONTWAIT)
            except BlockingIOError:
                self._turn(flags)

    @override
    def recv_into(self, buffer: Buffer, nbytes: int = 0, flags: int = 0) -> int:
        while True:
            try:
                return super().recv_into(buffer, nbytes, flags | _DONTWAIT)
            except BlockingIOError:
                self._turn(flags)

    def _turn(self, flags: int) -> None:
        if flags & _DONTWAIT:
            raise BlockingIOError
        for hub in self.hubs:
            hub.turn(0.0)


class LocalSimulator:
    """A simulator of `robot` in lockstep in this process, and the folder for its files.

    `plant` is the simulator's plant file. The true motion is logged to `truth_log`, by default a
    file in the folder. `scanner` is the file in which a simulated external scanner logs the poses
    that it measures, `camera` the socket of a simulated camera on the platform. `board` is the
    file of a physics board to create; a robot with load cells has one anyway. If `detached`, the
    motors have no cables. Frames are logged as by `OwnSimulator`. Raises BadInputError.
    """

    def __init__(
        self,
        robot: Robot,
        plant: Path | None,
        truth_log: Path | None = None,
        scanner: Path | None = None,
        camera: Path | None = None,
        board: Path | None = None,
        detached: bool = False,
    ) -> None:
        self._stack = ExitStack()
        temporary = self._stack.enter_context(TemporaryDirectory(prefix="cdpr-simulator-"))
        self.folder = Path(temporary)
        """Folder for temporary files, removed at the end."""
        self.truth_log: Path = truth_log or self.folder / "truth.log"
        """The log of the true motion."""
        if board is None and robot.tension_sensors is not None:
            board = self.folder / "board"
        self.board = board
        """The physics board, which load cells need."""
        self.bus = f"simbus:local-{os.getpid()}-{next(_numbers)}"
        self._ends: list[tuple[socket.socket, socket.socket]] = []
        """Both ends of each connection."""
        self.hubs: list[Hub] = []
        try:
            self._open(robot, plant, scanner, camera, detached)
        except BaseException:
            self.stop()
            raise

    def _open(
        self,
        robot: Robot,
        plant: Path | None,
        scanner: Path | None,
        camera: Path | None,
        detached: bool,
    ) -> None:
        drives = simulated_drives(
            *(self._stack, robot, plant), detached=detached, truth_log=self.truth_log,
            scanner=scanner, board=self.board, camera=camera,
        )  # fmt: skip
        self._first_drive = drives[0]
        log = frame_log_at(next_frame_log())
        urls = robot_urls(robot, [self.bus])
        for bus in robot.buses:
            nodes = with_frame_log([drives[i] for i in robot.axes_on(bus.name)], log, bus.name)
            name = urls[bus.name].channel
            # nothing is gained by computing ahead: the loop waits for it
            hub = Hub(nodes, bitrate=bus.bitrate_bit_s, name=name, ahead=False)
            in_this_process[name] = self._connector(hub)
            self._stack.callback(in_this_process.pop, name)
            self._stack.callback(hub.close)
            self.hubs.append(hub)
        for number, hub in enumerate(self.hubs):
            hub.robot_hubs, hub.buses_before = self.hubs, self.hubs[:number]
        FaultBench(drives).connect(self.hubs)

    @property
    def sync_count(self) -> int:
        """Number of SYNCs so far, as in the log of the truth."""
        return self._first_drive.sync_count

    def stop(self) -> None:
        """End the simulator, and remove its folder."""
        self._stack.close()

    # -- requests beside the buses

    def inject(
        self,
        fault: str,
        axis: int | None = None,
        value: float | None = None,
        at_s: float | None = None,
    ) -> dict[str, Any]:
        """Inject a fault at bus time `at_s`, by default now; return the order with its values.

        `cdpr_sim_bus.cia402.faults` lists the faults; "mend" ends those of an axis, or all. Axes
        count from 1. The value 0 mends only this fault. Bus time is `truth()["time_s"]`, and the
        time of a clock that leads the bus. Raises BadInputError for an invalid order.
        """
        order = {"fault": fault, "axis": axis, "value": value, "at_s": at_s}
        return dict(self._ask("fault", order))

    def broken(self) -> list[dict[str, Any]]:
        """Return what is broken now: `fault`, `axis`, `value`."""
        return list(self._ask("broken"))

    def truth(self) -> dict[str, Any]:
        """Return the truth now, for a judge: `time_s`, `drives`, `platform`, `faults`.

        It needs no running loop. Each of `faults` has `fault`, `axis`, `value`, `at_s`, `ended_s`.
        """
        return dict(self._ask("truth"))

    def _ask(self, key: str, value: Any = True) -> Any:
        for hub in self.hubs:
            hub.turn(0.0)
        try:
            return self.hubs[0].requests[key](value)
        except RequestError as error:
            raise BadInputError(str(error)) from error

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
