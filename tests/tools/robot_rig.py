"""Simulated robots in separate processes."""

from __future__ import annotations

import itertools
import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np

import cdpr_profiles
from cdpr_rt.control.pid import Proportional
from cdpr_rt.motion.trajectory import TrapezoidalMove
from cdpr_tools.composition.session import Session
from cdpr_tools.output import Output

OUT = Output(as_json=True)
ROOT = Path(__file__).parents[2]
_names = itertools.count()


def robot_file(
    folder: Path,
    axes: Sequence[tuple[str, int]],
    *,
    period_s: float = 1e-3,
    optional: int = -1,
    drives: Sequence[str] = (),
) -> Path:
    """Write a robot with `axes` (bus, node id). Axis number `optional` is not mandatory.

    `drives` are the drive profiles of axes that do not use that of the shipped winch.
    """
    lines = ['name = "test robot"', f"sync_period_s = {period_s}"]
    # slow cycles are for paced buses on a busy machine
    lines += ["master_heartbeat_s = 0.4"] * (period_s >= 0.01)
    for bus in dict.fromkeys(bus for bus, _ in axes):
        lines += ["[[buses]]", f'name = "{bus}"']
    shipped = (Path(cdpr_profiles.__file__).parent / "winches/winch-mpp0923d.toml").read_text()
    for drive in drives:
        (folder / f"with-{drive}.toml").write_text(
            shipped.replace('"generic-cia402"', f'"{drive}"')
        )
    for i, (bus, node) in enumerate(axes):
        winch = f"with-{drives[i]}" if drives else "winch-mpp0923d"
        lines += ["[[axes]]", f'winch = "{winch}"', f'bus = "{bus}"', f"node_id = {node}"]
        lines += ["mandatory = false"] * (i == optional)
    path = folder / f"robot-{next(_names)}.toml"
    path.write_text("\n".join(lines))
    return path


class Simulator:
    """A running `cdpr sim up`. `ready` is its line of readiness."""

    def __init__(self, *arguments: str) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-m", "cdpr_tools.cli", "sim", "up", *arguments, "--exit-with-stdin"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            cwd=ROOT,
        )
        assert self.process.stdout is not None
        self.ready = json.loads(self.process.stdout.readline())["ready"]

    def kill(self) -> None:
        self.process.send_signal(signal.SIGKILL)
        self.process.wait(120)

    def close(self) -> None:
        assert self.process.stdin is not None
        self.process.stdin.close()
        try:
            self.process.wait(120)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait(120)


@contextmanager
def simulated(machine: str | Path, *options: str, name: str = "") -> Iterator[str]:
    """Run a simulated machine. Yield the URL for all of its buses."""
    bus = f"simbus:{name or unique()}"
    simulator = Simulator(str(machine), "--bus", bus, *options)
    try:
        yield bus
    finally:
        simulator.close()


def unique() -> str:
    return f"robot-{os.getpid()}-{next(_names)}"


def hold(
    session: Session,
    seconds: float,
    speed_rad_s: Sequence[float] | None = None,
    gain_Nm_rad: float = 3.0,
) -> None:
    """Run all axes with a proportional controller, at rest or at constant speed."""
    n = session.device.n
    speed = np.zeros(n) if speed_rad_s is None else np.array(speed_rad_s, float)
    start = session.device.feedback.position_rad.copy()
    controller = Proportional(np.full(n, gain_Nm_rad), np.full(n, 1.5))
    session.follow(controller, TrapezoidalMove(start, speed, seconds - 0.2, 0.1))
