"""The daemon's loop as benches run it: on a simulator of its own, its processor time measured."""

from __future__ import annotations

import json
import math
import os
import subprocess
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any, Self

import numpy as np

from cdpr_drivers.robot.robot_buses import robot_urls
from cdpr_profiles import Robot, load_robot
from cdpr_profiles.platform import Platform
from cdpr_rt.core.cycle_row import Row
from cdpr_rt.core.shared_block import RowReader, SharedBlock
from cdpr_rt.runtime.right import PublishedRight
from cdpr_tools.composition.simulator import OwnSimulator
from cdpr_tools.daemon.processes.child import Child
from cdpr_tools.daemon.processes.launcher import LOOP, SERVICE
from cdpr_tools.daemon.settings import RunSettings
from cdpr_tools.errors import WorkFailedError
from cdpr_tools.processes.module_process import end_by_stdin, module_command

_SCHEDULED = 2  # CPUCLOCK_SCHED: as the scheduler counts, to the nanosecond


def processor_time_s(pid: int) -> float:
    """Return the processor time of all threads of a process, past ones included."""
    # a process' clock is named by its id (clock_getcpuclockid, of which Python has none)
    return time.clock_gettime_ns((~pid << 3) | _SCHEDULED) * 1e-9


LIVE_CLIENT = "cdpr_tools.bench.daemon.live_client"
_RING_S = 60.0
_TIMEOUT_S = 60.0
_STOP_S = 20.0
_RIGHT_NS = 10**9
_TO_AND_FRO_RAD = 10.0
_TURN_S = 0.05
_LEG_S = 2.0
_BOX_SHARE = 0.25
_SIMULATOR_PRIORITY = 40
_TOLERATED = {
    "missed_cycles": 1000,
    "missed_in_window": 10_000,
    "stale_cycles": 10_000,
    "late_s": 5.0,
}


def with_tolerant_limits(robot: Robot, folder: Path) -> Robot:
    """Return `robot` with a copy of its file in `folder` that counts missing answers only."""
    path = folder / f"{robot.profile}.toml"
    lines = robot.path.read_text().splitlines()
    kept = [line for line in lines if line.split(" =")[0] not in _TOLERATED]
    if "[limits]" not in kept:
        kept.append("[limits]")
    place = kept.index("[limits]") + 1
    limits = [f"{key} = {most}" for key, most in _TOLERATED.items()]
    path.write_text("\n".join([*kept[:place], *limits, *kept[place:], ""]))
    return load_robot(str(path))


def answers_in_time(simulator: OwnSimulator) -> None:
    """Have simulated drives answer whatever else this machine does, as drives of their own would.

    Where that is denied, a busy machine has them answer late, and the loop take them for lost.
    """
    with suppress(PermissionError):
        priority = os.sched_param(_SIMULATOR_PRIORITY)
        os.sched_setscheduler(simulator.process.pid, os.SCHED_FIFO, priority)


class BenchDaemon:
    """The loop of `robot` with a paced simulator of its own, its drives enabled and turning.

    A robot with a platform has its cables tightened and its platform led to and fro by `pose`.

    `folder` is for the socket and the recordings. The right to move is this object's.
    """

    def __init__(self, robot: Robot, folder: Path) -> None:
        self.robot = robot
        self.block = SharedBlock.create(len(robot.axes), _RING_S, 1.0 / robot.sync_period_s)
        self._right = PublishedRight(self.block)
        self._right.begin(0)
        self._folder = folder
        self._bus = f"simbus:bench-{time.monotonic_ns() % 10**9}"
        self._stack = ExitStack()
        self.loop: Child | None = None
        self._ends = () if robot.platform is None else _ends(robot.platform)
        self._legs, self._next_leg = 0, math.inf

    def __enter__(self) -> Self:
        """Boot, check and enable; raises WorkFailedError."""
        with self._stack as stack:
            simulator = OwnSimulator(self.robot.reference, self._bus, paced=True)
            stack.callback(simulator.stop)
            answers_in_time(simulator)
            self.loop = Child(LOOP, self._settings(serving=False), (simulator.lifeline,))
            stack.callback(self.loop.stop, _STOP_S)
            self._await("ready")
            self._leave_core(simulator.process.pid)
            self._keep_right_to_move()
            self._stack = stack.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        """Stop under control."""
        self._stack.close()

    def _leave_core(self, simulator_pid: int) -> None:
        """Leave the loop's core to it, if it has one, as the daemon's launcher does."""
        assert self.loop is not None  # about to be entered
        allowed = os.sched_getaffinity(0)
        rest = allowed - os.sched_getaffinity(self.loop.process.pid)
        if rest:
            self._stack.callback(os.sched_setaffinity, 0, allowed)
            for pid in (0, simulator_pid):
                os.sched_setaffinity(pid, rest)

    def buses(self) -> list[str]:
        """Return the simulated buses' names."""
        return [url.channel for url in robot_urls(self.robot, (self._bus,)).values()]

    def _settings(self, *, serving: bool) -> RunSettings:
        return RunSettings(
            robot=self.robot.reference,
            name="bench",
            buses=(self._bus,),
            simulated=True,
            own_simulator=True,
            socket=self._folder / "bench.sock",
            record=self._folder / "recordings" if serving else None,
            live=0 if serving else None,
            launcher_pid=os.getpid(),
            block_fd=self.block.fd,
        )

    def move(self, speed_rad_s: float) -> None:
        """Give the drives power where they have none, and move to and fro from now on.

        Bare axes turn at this speed; a platform goes as fast as it may.
        """
        if self._ends:
            if self.block.status()["state"] != "active":
                self._run("tighten", {})
                self._await("active", "tighten", done=True)
            self._lead()
            self._await("active", "pose")
            return
        turns = [_TO_AND_FRO_RAD * (-1) ** i for i in range(len(self.robot.axes))]
        self._run("sweep", {"distance_rad": turns, "speed_rad_s": speed_rad_s, "legs": 1000})
        self._await("active", "sweep")

    def _run(self, program: str, arguments: dict[str, Any]) -> None:
        self._keep_right_to_move()
        do = "program" if self.block.status()["state"] == "active" else "enable"
        right = self._right.number
        self.block.post_command({"do": do, "right": right, "program": program, "wanted": arguments})

    def _lead(self) -> None:
        """Send the platform to the other end of its way."""
        self._run("pose", self._ends[self._legs % 2])
        self._legs += 1
        self._next_leg = time.monotonic() + _LEG_S

    def measure(self, seconds: float) -> tuple[Row, float]:
        """Let it run for `seconds`; return the rows and the loop's processor time, s."""
        assert self.loop is not None  # entered
        reader = RowReader(self.block)
        begin_s = processor_time_s(self.loop.process.pid)
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            time.sleep(0.1)
            self._keep_right_to_move()
            if time.monotonic() > self._next_leg:
                self._lead()
        spent_s = processor_time_s(self.loop.process.pid) - begin_s
        rows = reader.read()
        status = self.block.status()
        if status["state"] != "active" or reader.lost:
            raise WorkFailedError(f"{self.robot.name}: {status['state']}: {status['reason']}")
        return rows, spent_s

    @contextmanager
    def served(self) -> Iterator[None]:
        """Record every cycle in the block, with a client of each live view, in the block."""
        settings = self._settings(serving=True).with_ports_bound()
        settings.socket.unlink(missing_ok=True)
        child = Child(SERVICE, settings, settings.service_fds)
        for fd in settings.service_fds:
            os.close(fd)  # the service has inherited them
        try:
            client = _LiveClient(settings.socket)
            try:
                yield
            finally:
                client.close()
        finally:
            child.stop(_STOP_S)

    def recordings(self) -> list[Path]:
        """Return what has been recorded so far."""
        return sorted((self._folder / "recordings").glob("*.mcap"))

    def _keep_right_to_move(self) -> None:
        self._right.until(time.monotonic_ns() + _RIGHT_NS)

    def _await(self, state: str, program: str = "idle", *, done: bool = False) -> None:
        """Wait for this state and program in the loop's status; replies may go to the service."""
        assert self.loop is not None  # about to be entered
        deadline = time.monotonic() + _TIMEOUT_S
        status: dict[str, Any] = {}
        refusal = ""
        while time.monotonic() < deadline and not self.loop.end:
            self._keep_right_to_move()
            status = self.block.status()
            if not status:  # it compiles its kernels, once for this machine, before it tells
                deadline = time.monotonic() + _TIMEOUT_S
            if (status.get("state"), status.get("program")) == (state, program) and (
                not done or status["program_progress"].get("done")
            ):
                return
            reply = self.block.take_reply()
            refusal = "" if reply is None or reply["ok"] else str(reply["text"])
            if refusal or (status.get("state") in ("fault", "inactive") and status.get("reason")):
                break
            time.sleep(_TURN_S)
        reason = self.loop.end or refusal or status.get("reason", "")
        raise WorkFailedError(f"{self.robot.name}: does not become {state}: {reason}")


def _ends(platform: Platform) -> tuple[dict[str, Any], ...]:
    """Return two poses on either side of the middle of the workspace, as `pose` takes them."""
    box = np.array([platform.workspace_min_m, platform.workspace_max_m])
    middle, half = box.mean(axis=0), _BOX_SHARE * (box[1] - box[0])
    return tuple({"position_m": (middle + sign * half).tolist()} for sign in (-1.0, 1.0))


class _LiveClient:
    """A program that looks at both live views as fast as they go."""

    def __init__(self, control: Path) -> None:
        self._process = subprocess.Popen(
            module_command(LIVE_CLIENT, str(control)),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self._process.stdout is not None  # opened with PIPE
        line = self._process.stdout.readline()
        if not line or not json.loads(line).get("watching"):
            self.close()
            raise WorkFailedError("the live view cannot be reached")

    def close(self) -> None:
        end_by_stdin(self._process, _STOP_S)
