"""The baseline loop in a process of its own, with a robot's drives booted for it."""

from __future__ import annotations

import json
import math
import os
import subprocess
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

import numpy as np

from cdpr_drivers.robot.robot_boot import boot_robot, open_networks
from cdpr_drivers.robot.robot_buses import robot_urls
from cdpr_profiles import Robot
from cdpr_rt.control.tuning import stiffest_pid
from cdpr_rt.core.clock import PacedClock
from cdpr_rt.core.supervision.limits import Limits
from cdpr_rt.robots.robot_arrays import limits_of
from cdpr_tools.bench.daemon.loop_daemon import answers_in_time
from cdpr_tools.composition.simulator import OwnSimulator
from cdpr_tools.errors import WorkFailedError
from cdpr_tools.processes.module_process import module_command

PROGRAM = "cdpr_tools.bench.daemon.loop_baseline"
OF_PLATFORM = "cdpr_tools.bench.daemon.pose_baseline"
_BANDWIDTHS_HZ = (20.0, 15.0, 12.0, 8.0, 5.0)
_TIMEOUT_S = 120.0
_CYCLIC_TORQUE = 10
_LIMITS = ("torque_Nm", "torque_rate_Nm_s", "speed_rad_s", "following_error_rad", "tension_max_N")


def measure(robot: Robot, seconds: float, speed_rad_s: float) -> dict[str, Any]:
    """Turn the robot's motors, or lead its platform, for `seconds` under the baseline loop.

    Returns its figures; raises WorkFailedError when it ends early, or a limit stopped it.
    """
    program = PROGRAM if robot.platform is None else OF_PLATFORM
    limits = limits_of(robot)
    with _booted(robot, limits) as channels:
        given = {**_axes(robot, limits, channels), "seconds": seconds, "speed_rad_s": speed_rad_s}
        done = subprocess.run(
            module_command(program, json.dumps(given)),
            capture_output=True,
            text=True,
            timeout=_TIMEOUT_S + seconds,
            check=False,
        )
    if done.returncode != 0:
        raise WorkFailedError(f"the baseline loop ended: {done.stderr.strip()[-300:]}")
    measured: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    if measured["stopped"]:
        raise WorkFailedError(f"the baseline loop: a limit for {measured['stopped']} cycles")
    return measured


@contextmanager
def _booted(robot: Robot, limits: Limits) -> Iterator[dict[str, str]]:
    """Boot the drives of a simulator of their own; yield each bus' channel.

    The drives watch no heartbeat: the baseline loop sends none, which spares it the cost.
    """
    with ExitStack() as stack:
        simulator = OwnSimulator(robot.reference, f"simbus:baseline-{os.getpid()}", paced=True)
        stack.callback(simulator.stop)
        answers_in_time(simulator)
        urls = robot_urls(robot, (simulator.bus,))
        with ExitStack() as booting:
            networks = open_networks(booting, robot, urls, PacedClock())
            torque_Nm = np.asarray(limits.torque_Nm).tolist()
            boot_robot(booting, robot, networks, torque_Nm)
            for axis in robot.axes:
                networks[axis.bus].write(axis.node_id, 0x1016, 1, 0)
                networks[axis.bus].write(axis.node_id, 0x6060, 0, _CYCLIC_TORQUE)
        yield {name: url.channel for name, url in urls.items()}


def _axes(robot: Robot, limits: Limits, channels: dict[str, str]) -> dict[str, Any]:
    """Return what the loop has to know of its axes, which are all alike."""
    winch, period_s = robot.axes[0].winch, robot.sync_period_s
    motor = winch.motor
    design = stiffest_pid(motor.rotor_inertia_kg_m2, winch.latency_s, _BANDWIDTHS_HZ, period_s)
    buses: dict[str, dict[int, str]] = {}
    for axis in robot.axes:
        buses.setdefault(channels[axis.bus], {})[axis.node_id] = str(axis.winch.drive.eds)
    gains = design.gains
    return {
        "robot": robot.reference,
        "buses": buses,
        "period_s": period_s,
        "counts_per_rad": winch.encoder_counts_per_turn / math.tau,
        "per_mille_per_Nm": 1e3 / motor.rated_torque_Nm,
        "cable_m_per_rad": winch.cable_m_per_motor_rad,
        "gains": [
            gains.proportional_Nm_rad,
            gains.integral_Nm_rad_s,
            gains.derivative_Nms_rad,
        ],
        "limits": {name: float(np.min(getattr(limits, name))) for name in _LIMITS},
    }
