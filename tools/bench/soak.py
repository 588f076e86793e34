"""Run a whole robot in lockstep for hours of bus time; nothing may leak and no frame be lost."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drivers.bus.budget import answer_pdos, command_pdos
from cdpr_drivers.errors import DriverError
from cdpr_profiles import Robot
from cdpr_rt.control.pid import Proportional
from cdpr_rt.errors import ControlError
from cdpr_rt.motion.trajectory import TrapezoidalMove
from cdpr_tools.bench.harness import Figures
from cdpr_tools.composition.session import Session, open_robot
from cdpr_tools.errors import WorkFailedError
from cdpr_tools.output import Output

MEMORY_LIMIT_KiB = 2048
"""Allowed memory growth of each process after its warm-up, for fluctuations of the allocator."""
_HOUR_S = 3600.0
LEG_S, _RAMP_S = 60.0, 0.5
_WARM_UP_CYCLES = 12_000  # until every row of the recorder's ring has been written once
_SPEED_RAD_S = 1.0
_TORQUE_SHARE = 0.5
# phase, in rad, of the loop's natural frequency during the delay of one and a half cycles
_PHASE = 0.25


@dataclass(frozen=True)
class Process:
    """Resources that this process, with master and simulator, holds at one moment."""

    memory_KiB: int
    """Private memory of the process, swapped out or not, without file-backed pages."""
    open_files: int

    @classmethod
    def now(cls) -> Process:
        """Return the present resources."""
        lines = Path("/proc/self/status").read_text().splitlines()
        status = dict(line.split(":", 1) for line in lines)
        memory = sum(int(status[key].split()[0]) for key in ("RssAnon", "RssShmem", "VmSwap"))
        return cls(memory, sum(1 for _ in Path("/proc/self/fd").iterdir()))


def bus_counts(session: Session) -> dict[str, dict[str, Any]]:
    """Return for each bus, by its name, the bus' counts and the master's work on it."""
    device = session.device
    status = session.machine.simulated_status()
    return {
        bus.name: {
            **status[bus.name],
            "cycles": group.feedback.cycle,
            "transmits": device.transmits,
            "missed": group.missed,
        }
        for bus, group in zip(device.buses, device.groups, strict=True)
    }


def compare(
    name: str, session: Session, before: Mapping[str, Any], after: Mapping[str, Any]
) -> dict[str, Any]:
    """Compare the frames that the master should have exchanged on a bus with the counts of the bus.

    `before` and `after` are the counts at the begin and the end of the compared interval.
    `overruns` are cycles whose frames did not fit into the bus time between two SYNCs. `tolerance`
    is the number of heartbeats that may fall just inside or outside the interval. `lost` is the
    number of frames that one side has sent and the other has not seen.
    """
    device = session.device
    bus = next(bus for bus in device.buses if bus.name == name)
    gained = {
        key: value - before[key] for key, value in after.items() if isinstance(value, int | float)
    }
    cycles, missed = gained["cycles"], gained["missed"]
    frames = cycles - missed + cycles / max(1, round(bus.network.heartbeat_s / device.period_s))
    for drive in (axis.drive for axis in bus.axes):
        frames += gained["transmits"] * len(command_pdos(drive))
        frames += sum(cycles / pdo.transmission_type for pdo in answer_pdos(drive))
        frames += gained["bus_time_s"] / drive.heartbeat_producer_s
    syncs_lost, tolerance = cycles - gained["sync_count"], 2 * (len(bus.axes) + 1)
    gap = max(0, round(frames) - gained["frames"] - tolerance)
    return {
        "bus": name,
        "syncs_lost": syncs_lost,
        "answers_missed": missed,
        "dropped": gained["dropped"],
        "malformed": gained["malformed"],
        "frames_expected": round(frames),
        "frames_counted": gained["frames"],
        "overruns": gained["overruns"],
        "tolerance": tolerance,
        "lost": abs(syncs_lost) + missed + gained["dropped"] + gained["malformed"] + gap,
    }


def growth(samples: Sequence[Process]) -> Process:
    """Return a process' memory growth: the minimum of the second half minus that of the first."""
    middle = len(samples) // 2
    first, later = samples[:middle], samples[middle:]
    return Process(
        min(s.memory_KiB for s in later) - min(s.memory_KiB for s in first),
        min(s.open_files for s in later) - min(s.open_files for s in first),
    )


class Soak:
    """Moves an enabled robot back and forth for hours, and samples its process meanwhile."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.samples: list[Process] = []
        device = session.device
        motors = [axis.winch.motor for axis in session.robot.axes]
        frequency = _PHASE / (1.5 * device.period_s)
        gain = frequency**2 * np.array([motor.rotor_inertia_kg_m2 for motor in motors])
        limit = _TORQUE_SHARE * np.array([motor.rated_torque_Nm for motor in motors])
        self._controller = Proportional(gain, limit)
        self._speed = _SPEED_RAD_S * np.where(np.arange(device.n) % 2, -1.0, 1.0)
        self.bus_s = self.wall_s = 0.0
        self._before = bus_counts(session)

    def run(
        self, seconds: float, advance: Callable[[float], None], most_wall_s: float = math.inf
    ) -> None:
        """Move for `seconds` of bus time; after `most_wall_s`, end with the present leg.

        Raises WorkFailedError if the motion ends early.
        """
        self._before = bus_counts(self.session)
        self._sample()
        begin, cycle = time.monotonic(), self.session.device.feedback.cycle
        period_s = self.session.device.period_s
        try:
            while self.bus_s < seconds - period_s and self.wall_s < most_wall_s:
                self._leg(min(LEG_S, seconds - self.bus_s))
                self.bus_s = (self.session.device.feedback.cycle - cycle) * period_s
                self.wall_s = time.monotonic() - begin
                advance(self.bus_s)
                self._sample()
        except (ControlError, DriverError) as error:
            hours = (self.session.device.feedback.cycle - cycle) * period_s / _HOUR_S
            raise WorkFailedError(f"after {hours:.4f} h of bus time: {error}") from error

    def _leg(self, seconds: float) -> None:
        start = self.session.device.feedback.position_rad.copy()
        cruise_s = max(0.0, seconds - 2.0 * _RAMP_S)
        self.session.follow(
            self._controller, TrapezoidalMove(start, self._speed, cruise_s, _RAMP_S)
        )
        self._speed = -self._speed

    def _sample(self) -> None:
        self.samples.append(Process.now())

    def figures(self, title: str) -> Figures:
        """Return the results: a row for each bus."""
        after = bus_counts(self.session)
        buses = {
            name: compare(name, self.session, before, after[name])
            for name, before in self._before.items()
        }
        grown = growth(self.samples)
        lost = sum(bus["lost"] for bus in buses.values())
        cycles = round(self.bus_s / self.session.device.period_s)
        failed = [f"{lost} frames were lost"] if lost else []
        if grown.memory_KiB > MEMORY_LIMIT_KiB or grown.open_files > 0:
            failed.append(
                f"{grown.memory_KiB} KiB more memory and {grown.open_files} more open files in use"
            )
        return Figures(
            f"{title}: {self.bus_s / _HOUR_S:.3f} h of bus time, {cycles} cycles, in "
            f"{self.wall_s:.0f} s ({1e6 * self.wall_s / max(1, cycles):.0f} us each)",
            {f"bus {name}": {k: v for k, v in bus.items() if k != "bus"}
             for name, bus in buses.items()},
            notes=[
                f"{self.samples[-1].memory_KiB / 1024:.0f} MiB, grown by {grown.memory_KiB} KiB; "
                f"open files grown by {grown.open_files}"
            ],
            more={
                "bus_hours": self.bus_s / _HOUR_S,
                "wall_s": round(self.wall_s, 1),
                "cycles": cycles,
                "memory_growth_KiB": grown.memory_KiB,
                "open_files_growth": grown.open_files,
                "lost_frames": lost,
            },
            error="; ".join(failed),
        )  # fmt: skip


def measure(
    robot: Robot, hours: float, most_wall_s: float, rate_Hz: float | None, out: Output
) -> Figures:
    """Run `robot` on simulated drives for `hours` of bus time; return the figures.

    The run ends earlier when `most_wall_s` have passed. `rate_Hz` replaces the robot's cycle rate:
    at a lower rate, more bus time passes with the same number of frames. Raises WorkFailedError if
    the motion ends early.
    """
    if rate_Hz is not None:
        robot = replace(robot, sync_period_s=1.0 / rate_Hz)
    seconds = hours * _HOUR_S
    with open_robot(robot, ["simbus:"], out) as session:
        session.enable()
        Soak(session).run(_WARM_UP_CYCLES * robot.sync_period_s, lambda _: None)
        soak = Soak(session)
        with out.progress(f"{hours:g} h of bus time", seconds) as advance:
            soak.run(seconds, advance, most_wall_s)
        figures = soak.figures(f"{robot.reference}, {len(robot.axes)} drives")
        session.disable()
    return figures
