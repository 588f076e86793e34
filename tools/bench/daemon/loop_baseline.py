"""Run as a program: a baseline control loop, on `canopen`'s PDOs and plain NumPy.

The argument is JSON: {"buses": {NAME: {NODE: EDS}}, "period_s", "seconds", "counts_per_rad",
"per_mille_per_Nm", "cable_m_per_rad", "gains", "limits", "speed_rad_s"}. Standard output gets
{"running": true} when the motors turn under the loop, and at the end {"cycles", "late", "missed",
"stopped" (cycles without torque, a limit being exceeded), "processor_s", "turned_rad", and for each
cycle "lateness_s", "exchange_s", "compute_s"}.
"""

from __future__ import annotations

import json
import sys
import threading
import time
from collections.abc import Mapping
from functools import partial
from typing import Any

import canopen
import numpy as np

from cdpr_rt.runtime.realtime import enable_realtime, freeze_memory

_NOTIFIER_CYCLE_S = 0.05
_LATE_SHARE, _TIMEOUT_SHARE = 0.1, 0.6
_WARM_UP = 200
_ENABLE = (6, 7, 15)
_CYCLES_A_STEP = 50
_STATES = ((0x4F, 0x40), (0x6F, 0x21), (0x6F, 0x23), (0x6F, 0x27), (0x6F, 0x07), (0x4F, 0x08))
_NUMBERS = list(range(len(_STATES)))
_FAULT = _NUMBERS[-1]
_FLOATS = (
    *("setpoint_rad", "position_rad", "velocity_rad_s", "torque_actual_Nm", "torque_asked_Nm"),
    *("torque_sent_Nm", "tension_N", "cable_length_m"),
)


class BaselineLoop:
    """Cyclic torque control of all axes: a PID in arrays, limits checked, each cycle kept.

    PDOs are read and written as the package's documentation shows it.
    """

    warm_up_s = 0.0
    """How long it moves before its cycles count."""

    def __init__(self, given: Mapping[str, Any]) -> None:
        nodes = [(bus, int(node)) for bus, of in given["buses"].items() for node in of]
        self.n = n = len(nodes)
        self.period_s = float(given["period_s"])
        self.per_rad = float(given["counts_per_rad"])
        self.per_Nm = float(given["per_mille_per_Nm"])
        self.kp, self.ki, self.kd = (float(gain) for gain in given["gains"])
        self.limits: dict[str, float] = given["limits"]
        self.status, self.counts, self.actual = np.zeros((3, n))
        self.waiting, self.complete = 0, threading.Event()
        self.networks = []
        self.nodes: list[Any] = []
        for bus, of in given["buses"].items():
            network = canopen.Network()
            network.NOTIFIER_CYCLE = _NOTIFIER_CYCLE_S
            network.connect(interface="simbus", channel=bus)
            self.networks.append(network)
            for node_id, eds in of.items():
                self._add(network.add_node(int(node_id), eds), nodes.index((bus, int(node_id))))
        for network in self.networks:
            network.nmt.state = "OPERATIONAL"
        self.integral, self.velocity, self.last, self.torque = np.zeros((4, n))
        self.cable_m_per_rad = float(given["cable_m_per_rad"])
        self.controlword = self.stopped = 0
        fields = [("time_s", "f8"), *((name, "f8", (n,)) for name in _FLOATS)]
        fields += [("statusword", "u2", (n,)), ("state", "i1", (n,))]
        self.kept = np.zeros(round((given["seconds"] + 20.0) / self.period_s), fields)

    def _add(self, node: Any, i: int) -> None:
        node.tpdo.read()
        node.rpdo.read()
        node.tpdo[1].add_callback(partial(self._take, i))
        self.nodes.append(node)

    def _take(self, i: int, answer: Any) -> None:
        self.status[i] = answer[0x6041].raw
        self.counts[i] = answer[0x6064].raw
        self.actual[i] = answer[0x6077].raw
        self.waiting -= 1
        if not self.waiting:
            self.complete.set()

    def exchange(self) -> bool:
        """Send SYNC on all buses and wait for all answers; return whether they came in time."""
        self.waiting = self.n
        self.complete.clear()
        for network in self.networks:
            network.sync.transmit()
        return self.complete.wait(_TIMEOUT_SHARE * self.period_s)

    def estimate(self) -> None:
        """Turn what the drives have sent into states, angles, speeds, torques and tensions."""
        self.position = self.counts / self.per_rad
        measured = (self.position - self.last) / self.period_s
        self.velocity = 0.8 * self.velocity + 0.2 * measured
        self.last = self.position
        self.measured_Nm = self.actual / self.per_Nm
        self.length_m = self.position * self.cable_m_per_rad
        self.tension_N = np.abs(self.measured_Nm / self.cable_m_per_rad)
        words = self.status.astype(int)
        self.state = np.select([(words & mask) == word for mask, word in _STATES], _NUMBERS, -1)

    def control(self, k: int, start: Any, speed_rad_s: float) -> None:
        """Compute torques for a turn at constant speed, and stop where a limit is exceeded."""
        setpoint = start + speed_rad_s * k * self.period_s
        error = setpoint - self.position
        self.integral = np.clip(self.integral + error * self.period_s, -1.0, 1.0)
        torque_asked = self.kp * error + self.ki * self.integral
        self.command(k, setpoint, torque_asked + self.kd * (speed_rad_s - self.velocity))

    def command(self, k: int, setpoint: Any, torque_asked: Any) -> None:
        """Bound the torques that are wanted, none where a limit is exceeded; keep the cycle."""
        limits, error = self.limits, setpoint - self.position
        step = limits["torque_rate_Nm_s"] * self.period_s
        torque = np.clip(torque_asked, self.torque - step, self.torque + step)
        torque = np.clip(torque, -limits["torque_Nm"], limits["torque_Nm"])
        if (
            np.any(np.abs(self.velocity) > limits["speed_rad_s"])
            or np.any(np.abs(error) > limits["following_error_rad"])
            or np.any(self.tension_N > limits["tension_max_N"])
            or np.any(self.state == _FAULT)
            or not np.all(np.isfinite(torque))
        ):
            torque = np.zeros(self.n)
            self.stopped += 1
        self.torque = torque
        self.keep(k, setpoint, torque_asked)

    def keep(self, k: int, setpoint: Any, torque_asked: Any) -> None:
        """Record the cycle."""
        row = self.kept[k % self.kept.size]
        row["time_s"] = k * self.period_s
        values = {
            "setpoint_rad": setpoint,
            "position_rad": self.position,
            "velocity_rad_s": self.velocity,
            "torque_actual_Nm": self.measured_Nm,
            "torque_asked_Nm": torque_asked,
            "torque_sent_Nm": self.torque,
            "tension_N": self.tension_N,
            "cable_length_m": self.length_m,
            "statusword": self.status,
            "state": self.state,
        }
        for name, value in values.items():
            row[name] = value

    def transmit(self) -> None:
        """Send controlwords and torques."""
        for node, torque in zip(self.nodes, self.torque, strict=True):
            order = node.rpdo[1]
            order[0x6040].raw = self.controlword
            order[0x6071].raw = round(torque * self.per_Nm)
            order.transmit()

    def close(self) -> None:
        """Take the power and leave the buses."""
        self.controlword = 0
        self.torque = np.zeros(self.n)
        self.transmit()
        for network in self.networks:
            network.disconnect()


def run(given: Mapping[str, Any], make: type[BaselineLoop] = BaselineLoop) -> dict[str, Any]:
    """Enable the drives, move them for so many seconds, and return how it went."""
    loop = make(given)
    freeze_memory()
    enable_realtime()
    begin_enable = len(_ENABLE) * _CYCLES_A_STEP
    first = begin_enable + max(_WARM_UP, round(loop.warm_up_s / loop.period_s))
    cycles = first + round(given["seconds"] / loop.period_s)
    lateness, exchange, compute = np.zeros((3, cycles))
    late = missed = 0
    processor_s, start = 0.0, np.zeros(loop.n)
    deadline = time.monotonic()
    for k in range(cycles):
        if k < begin_enable:
            loop.controlword = _ENABLE[k // _CYCLES_A_STEP]
        if k == begin_enable:
            start = loop.last
        if k == first:
            print(json.dumps({"running": True}), flush=True)
            processor_s, late, missed, loop.stopped = time.process_time(), 0, 0, 0
        deadline += loop.period_s
        ahead = deadline - time.monotonic()
        if ahead > 0.0:
            time.sleep(ahead)
        woke = time.monotonic()
        lateness[k] = woke - deadline
        late += lateness[k] > _LATE_SHARE * loop.period_s
        if not loop.exchange():
            missed += loop.waiting
        came = time.monotonic()
        exchange[k] = came - woke
        loop.estimate()
        moving = max(0, k - begin_enable)
        loop.control(moving, start if k >= begin_enable else loop.last, _speed(given, moving))
        loop.transmit()
        compute[k] = time.monotonic() - came
    spent = time.process_time() - processor_s
    loop.close()
    return {
        "cycles": cycles - first,
        "late": int(late),
        "missed": int(missed),
        "stopped": int(loop.stopped),
        "lateness_s": lateness[first:].tolist(),
        "exchange_s": exchange[first:].tolist(),
        "compute_s": compute[first:].tolist(),
        "processor_s": spent,
        "turned_rad": (loop.last - start).tolist(),
    }


def _speed(given: Mapping[str, Any], moving: int) -> float:
    return float(given["speed_rad_s"]) if moving else 0.0


if __name__ == "__main__":
    print(json.dumps(run(json.loads(sys.argv[1]))))
