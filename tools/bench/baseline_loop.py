"""A simple control loop as baseline: PDOs of the `canopen` package and plain NumPy.

Run as a program, it turns drives that have been booted. Its argument is JSON, see `measure`.
Standard output gets one line of JSON at the end: "late", "missed", "stopped" (cycles without torque
because a limit was exceeded), "processor_s", and for each cycle "lateness_s" and "compute_s".
"""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import replace
from itertools import count
from typing import Any

import canopen
import numpy as np
from canopen.objectdictionary import ObjectDictionary

from cdpr_drivers.robot.robot_boot import boot_robot, open_networks
from cdpr_drivers.robot.robot_buses import robot_urls
from cdpr_profiles import Robot, load_robot
from cdpr_rt.control.tuning import stiffest_pid
from cdpr_rt.core.clock import PacedClock
from cdpr_rt.loop.realtime import enable_realtime, freeze_memory
from cdpr_rt.model.robot_arrays import limits_of
from cdpr_tools.composition.simulator import OwnSimulator
from cdpr_tools.errors import WorkFailedError
from cdpr_tools.processes import module_command

_BANDWIDTHS_HZ = (20.0, 15.0, 12.0, 8.0, 5.0)
_TIMEOUT_S = 120.0
_LIMITS = ("torque_Nm", "torque_rate_Nm_s", "speed_rad_s", "following_error_rad", "tension_max_N")
_NOTIFIER_CYCLE_S = 0.05
_LATE_SHARE, _TIMEOUT_SHARE, _WARM_UP = 0.1, 0.6, 200
_ENABLE, _CYCLES_A_STEP = (6, 7, 15), 50
_FAULT = 0x08
_FEEDBACK = (0x6041, 0x6064, 0x6077)
_FLOATS = ("setpoint_rad", "position_rad", "velocity_rad_s", "torque_actual_Nm", "torque_sent_Nm")
_numbers = count(1)


def measure(robot: Robot, seconds: float, speed_rad_s: float) -> dict[str, Any]:
    """Turn the robot's motors for `seconds` under the baseline loop.

    Returns its figures; raises WorkFailedError if it ends early.
    """
    with simulator(robot) as bus:
        given = {
            "robot": robot.reference,
            "period_s": robot.sync_period_s,
            "channels": _booted(robot, bus),
            "seconds": seconds,
            "speed_rad_s": speed_rad_s,
        }
        done = subprocess.run(
            module_command("cdpr_tools.bench.baseline_loop", json.dumps(given)),
            capture_output=True,
            text=True,
            timeout=_TIMEOUT_S + seconds,
            check=False,
        )
    if done.returncode != 0:
        raise WorkFailedError(f"the baseline loop ended: {done.stderr.strip()[-300:]}")
    measured: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return measured


@contextmanager
def simulator(robot: Robot) -> Iterator[str]:
    """Run a simulator of the robot in a separate process; yield its bus.

    If the system allows it, the drives answer in time even on a busy machine, as real drives do.
    """
    bus = f"simbus:bench-{os.getpid()}-{next(_numbers)}"
    own = OwnSimulator(robot.reference, bus, paced=True)
    try:
        with suppress(PermissionError):
            os.sched_setscheduler(own.process.pid, os.SCHED_FIFO, os.sched_param(40))
        yield bus
    finally:
        own.stop()


def _booted(robot: Robot, bus: str) -> dict[str, str]:
    """Boot the drives; return each bus' channel.

    The drives monitor no heartbeat: the baseline loop sends none and so saves the cost.
    """
    urls = robot_urls(robot, (bus,))
    with ExitStack() as booting:
        networks = open_networks(booting, robot, urls, PacedClock())
        boot_robot(booting, robot, networks, np.asarray(limits_of(robot).torque_Nm).tolist())
        for axis in robot.axes:
            networks[axis.bus].write(axis.node_id, 0x1016, 1, 0)
            networks[axis.bus].write(axis.node_id, 0x6060, 0, 10)  # cyclic torque
    return {name: url.channel for name, url in urls.items()}


class CanopenAxes:
    """Axes through PDOs of the `canopen` package, used as its documentation shows.

    The objects are looked up once and a callback decodes them, so that only the library's own work
    is counted. Each frame wakes its notifier thread.
    """

    def __init__(
        self, channels: Mapping[str, str], nodes: Sequence[tuple[str, int, ObjectDictionary | str]]
    ) -> None:
        """Read the PDO configuration from the nodes, each given as bus, id and EDS."""
        self._channels = channels
        self._networks: dict[str, Any] = {name: canopen.Network() for name in channels}
        self._commands: list[tuple[Any, Any, Any]] = []
        self.feedback = [(0, 0, 0)] * len(nodes)
        """Statusword, position and torque of each axis, in its drive's units."""
        self._waiting, self._complete = 0, threading.Event()
        with self.joined():
            for i, (bus, node_id, eds) in enumerate(nodes):
                self._add(i, self._networks[bus].add_node(node_id, eds))

    def _add(self, i: int, node: Any) -> None:
        node.tpdo.read()
        node.rpdo.read()
        answer, order = node.tpdo[1], node.rpdo[1]
        objects = [answer[index] for index in _FEEDBACK]

        def take(_pdo: object) -> None:
            self.feedback[i] = tuple(variable.raw for variable in objects)
            self._waiting -= 1
            if not self._waiting:
                self._complete.set()

        answer.add_callback(take)
        self._commands.append((order, order[0x6040], order[0x6071]))

    @contextmanager
    def joined(self) -> Iterator[None]:
        """Stay connected to the buses within the block."""
        with ExitStack() as stack:
            for name, network in self._networks.items():
                # stopping the library takes up to one of its cycles, which are 1 s by default
                network.NOTIFIER_CYCLE = _NOTIFIER_CYCLE_S
                network.connect(interface="simbus", channel=self._channels[name])
                stack.callback(network.disconnect)
            yield

    def start(self) -> None:
        """Switch the nodes to operational."""
        for network in self._networks.values():
            network.nmt.state = "OPERATIONAL"

    def exchange(self, timeout_s: float) -> int:
        """Send SYNC on all buses and wait for all answers; return how many are missing."""
        self._waiting = len(self._commands)
        self._complete.clear()
        for network in self._networks.values():
            network.sync.transmit()
        return 0 if self._complete.wait(timeout_s) else self._waiting

    def command(self, word: int, torques: Iterable[int]) -> None:
        """Send a controlword and torques."""
        for (pdo, controlword, torque), value in zip(self._commands, torques, strict=True):
            controlword.raw = word
            torque.raw = value
            pdo.transmit()


class _Control:
    """Cyclic torque control of all axes: a PID in arrays; checks limits and records each cycle."""

    def __init__(self, robot: Robot, cycles: int) -> None:
        # all axes are equal
        self.n, winch = len(robot.axes), robot.axes[0].winch
        self.period_s, motor, limits = robot.sync_period_s, winch.motor, limits_of(robot)
        self.per_rad = winch.encoder_counts_per_turn / math.tau
        self.per_Nm = 1e3 / motor.rated_torque_Nm
        self.cable_m_per_rad = winch.cable_m_per_motor_rad
        inertia, latency_s = motor.rotor_inertia_kg_m2, winch.latency_s
        self.gains = stiffest_pid(inertia, latency_s, _BANDWIDTHS_HZ, self.period_s).gains
        self.limits = {name: float(np.min(getattr(limits, name))) for name in _LIMITS}
        self.integral, self.velocity, self.position, self.torque = np.zeros((4, self.n))
        self.start = self.position
        self.stopped = 0
        fields = [("time_s", "f8"), *((name, "f8", (self.n,)) for name in _FLOATS)]
        self.kept = np.zeros(cycles, [*fields, ("statusword", "u2", (self.n,))])

    def update(self, k: int, feedback: Any, speed_rad_s: float) -> list[int]:
        """Return and store the torques for cycle k of a turn, zero if a limit is exceeded."""
        status, counts, actual = np.array(feedback).T
        position = counts / self.per_rad
        self.velocity = 0.8 * self.velocity + 0.2 * (position - self.position) / self.period_s
        self.position = position
        if not k:
            self.start = position
        measured_Nm = actual / self.per_Nm
        tension_N = np.abs(measured_Nm / self.cable_m_per_rad)
        setpoint = self.start + speed_rad_s * k * self.period_s
        error = setpoint - position
        self.integral = np.clip(self.integral + error * self.period_s, -1.0, 1.0)
        gains, limits = self.gains, self.limits
        wanted = gains.proportional_Nm_rad * error + gains.integral_Nm_rad_s * self.integral
        wanted = wanted + gains.derivative_Nms_rad * (speed_rad_s - self.velocity)
        step = limits["torque_rate_Nm_s"] * self.period_s
        torque = np.clip(wanted, self.torque - step, self.torque + step)
        torque = np.clip(torque, -limits["torque_Nm"], limits["torque_Nm"])
        if (
            np.any(np.abs(self.velocity) > limits["speed_rad_s"])
            or np.any(np.abs(error) > limits["following_error_rad"])
            or np.any(tension_N > limits["tension_max_N"])
            or np.any(status & _FAULT)
            or not np.all(np.isfinite(torque))
        ):
            torque = np.zeros(self.n)
            self.stopped += 1
        self.torque = torque
        self.kept[k % self.kept.size] = (
            k * self.period_s, setpoint, position, self.velocity, measured_Nm, torque, status,
        )  # fmt: skip
        return [round(value * self.per_Nm) for value in torque]


def _run(given: Mapping[str, Any]) -> dict[str, Any]:
    """Enable the drives, turn them for the given time, and return the results."""
    robot = replace(load_robot(given["robot"]), sync_period_s=given["period_s"])
    period_s = robot.sync_period_s
    begin_enable = len(_ENABLE) * _CYCLES_A_STEP
    first = begin_enable + _WARM_UP
    cycles = first + round(given["seconds"] / period_s)
    control = _Control(robot, cycles)
    nodes = [(axis.bus, axis.node_id, str(axis.winch.drive.eds)) for axis in robot.axes]
    axes = CanopenAxes(given["channels"], nodes)
    lateness, compute = np.zeros((2, cycles))
    late = missed = 0
    processor_s = 0.0
    with axes.joined():
        axes.start()
        freeze_memory()
        enable_realtime()
        deadline = time.monotonic()
        for k in range(cycles):
            if k == first:
                processor_s, late, missed, control.stopped = time.process_time(), 0, 0, 0
            deadline += period_s
            ahead = deadline - time.monotonic()
            if ahead > 0.0:
                time.sleep(ahead)
            lateness[k] = time.monotonic() - deadline
            late += lateness[k] > _LATE_SHARE * period_s
            missed += axes.exchange(_TIMEOUT_SHARE * period_s)
            came = time.monotonic()
            turning = max(0, k - begin_enable)
            torques = control.update(
                turning, axes.feedback, given["speed_rad_s"] if turning else 0.0
            )
            axes.command(_ENABLE[min(k // _CYCLES_A_STEP, len(_ENABLE) - 1)], torques)
            compute[k] = time.monotonic() - came
        spent = time.process_time() - processor_s
        axes.command(0, [0] * control.n)
    return {
        "late": int(late),
        "missed": int(missed),
        "stopped": int(control.stopped),
        "lateness_s": lateness[first:].tolist(),
        "compute_s": compute[first:].tolist(),
        "processor_s": spent,
    }


if __name__ == "__main__":
    print(json.dumps(_run(json.loads(sys.argv[1]))))
