"""Run as a program: a launcher whose two processes are stand-ins controlled by a file.

The stand-ins communicate like the real ones by shared memory, socket and exit status, and load
within a fraction of a second. The file `log` lists their actions in order.
"""

from __future__ import annotations

import errno
import json
import os
import select
import signal
import socket
import sys
import time
from pathlib import Path
from typing import Any

from cdpr_rt.core.shared_block import SharedBlock
from cdpr_rt.core.states import CUT_SHORT
from cdpr_tools.daemon import child, launcher
from cdpr_tools.daemon.child import POWER_UNCONFIRMED, end_with_launcher
from cdpr_tools.daemon.launcher import ServiceManager
from cdpr_tools.daemon.loop_file import POWER_OFF_SIGNAL, LauncherLock
from cdpr_tools.daemon.settings import RunSettings

NAME = "stand-in"


def main(folder: Path) -> int:
    launcher.LOOP, launcher.SERVICE = "stand_in_loop", "stand_in_service"  # type: ignore[misc]
    launcher._RESTART_S = (0.1, 0.1, 0.1)  # type: ignore[misc]
    plan = json.loads((folder / "plan.json").read_text())
    stalled_s = plan.get("stalled_s", 60.0)
    launcher._LOOP_STALLED_S = launcher._SERVICE_STALLED_S = stalled_s  # type: ignore[misc]
    launcher._SAME_PRESS_S = plan.get("same_press_s", 0.2)  # type: ignore[misc]
    launcher._SERVICE_START_S = plan.get("service_start_s", 60.0)  # type: ignore[misc]
    child._STOP_S = plan.get("stop_s", 30.0)  # type: ignore[misc]
    block = SharedBlock.create(1, 0.1, 100.0)
    lock = LauncherLock(folder / "control.sock")
    settings = RunSettings(
        robot=str(folder),
        name=NAME,
        socket=folder / "control.sock",
        lock_fd=lock.fd,
        launcher_pid=os.getpid(),
        block_fd=block.fd,
    )

    def tell(text: str) -> None:
        if "mistake" in plan:
            raise RuntimeError(plan["mistake"])
        print(json.dumps({"told": text, "status": block.status()}), flush=True)

    def ready(status: dict[str, object]) -> None:
        print(json.dumps({"ready": status}), flush=True)

    if "no_service" in plan:  # as if the machine had no room for another process

        def child_but_no_service(module: str, *more: Any) -> child.Child:
            if module == launcher.SERVICE:
                while not block.counters["loop_alive_ns"][0]:
                    time.sleep(0.01)
                raise BlockingIOError(errno.EAGAIN, os.strerror(errno.EAGAIN))
            return child.Child(module, *more)

        launcher.Child = child_but_no_service  # type: ignore[misc, assignment]

    daemon = launcher.Launcher(settings, block, tell, ready, ServiceManager())
    try:
        code = daemon.run()
    finally:
        lock.close()
    print(json.dumps({"reason": daemon.reason, "status": block.status()}), flush=True)
    return code


def _note(folder: Path, text: str) -> None:
    with (folder / "log").open("a") as log:
        log.write(text + "\n")


def _tell_pid(folder: Path, who: str) -> None:
    fresh = folder / f"{who}.new"
    fresh.write_text(str(os.getpid()))
    fresh.rename(folder / f"{who}.pid")


def _asked(number: signal.Signals) -> int:
    reader, writer = os.pipe2(os.O_NONBLOCK)
    signal.signal(number, lambda *_: os.write(writer, b"."))
    return reader


def loop() -> None:
    """Write a status and turn until requested to end, or follow the file `plan.json`."""
    settings = RunSettings.from_argv()
    folder = Path(settings.robot)
    plan = json.loads((folder / "plan.json").read_text())
    _tell_pid(folder, "loop")
    time.sleep(plan.get("loading_s", 0.0))
    end, power_off = _asked(signal.SIGTERM), _asked(POWER_OFF_SIGNAL)
    end_with_launcher(settings.launcher_pid)
    block = SharedBlock.attach(settings.block_fd)
    block.write_description({"lowering_s": plan.get("lowering_s", 0.0), "master_heartbeat_s": 0.1})
    block.counters["loop_pid"] = os.getpid()
    if "refuse" in plan:
        sys.exit(plan["refuse"])
    block.counters["loop_alive_ns"] = (
        time.monotonic_ns()
    )  # a test may stop the process from here on
    block.write_status(
        {"state": "ready", "reason": "", "driving": "stopping_s" in plan, **plan.get("status", {})}
    )
    while not select.select([end], [], [], 0.02)[0] and not (folder / "shutdown").exists():
        block.counters["loop_alive_ns"] = time.monotonic_ns()
        if (folder / "fault").exists():
            (folder / "fault").unlink()
            block.write_status({"state": "fault", "reason": "left: too fast", "since_ns": 1})
    end_s = time.monotonic() + plan.get("stopping_s", 0.0)
    while time.monotonic() < end_s:
        block.counters["loop_alive_ns"] = time.monotonic_ns()
        if select.select([power_off], [], [], 0.02)[0]:
            _note(folder, "power taken")
            block.write_status({"state": "unconfigured", "reason": CUT_SHORT})
            break
    _note(folder, "loop stopped")
    if plan.get("unconfirmed"):
        block.write_status({"state": "unconfigured", "reason": plan["unconfirmed"]})
        sys.exit(POWER_UNCONFIRMED)


def service() -> None:
    """Open the socket and wait for a request to end, or follow the file `plan.json`."""
    settings = RunSettings.from_argv()
    folder = Path(settings.robot)
    plan = json.loads((folder / "plan.json").read_text())
    if "refuse_service" in plan:
        _note(folder, "service refused")
        sys.exit(plan["refuse_service"])
    if "freeze_service" in plan and not (folder / "service.pid").exists():
        _tell_pid(folder, "service")
        os.kill(os.getpid(), signal.SIGSTOP)
    _tell_pid(folder, "service")
    while time.process_time() < plan.get("service_works_s", 0.0):
        pass
    end = _asked(signal.SIGTERM)
    end_with_launcher(settings.launcher_pid)
    block = SharedBlock.attach(settings.block_fd)
    settings.socket.unlink(missing_ok=True)
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind(str(settings.socket))
        listening.listen()
        while not select.select([end], [], [], 0.02)[0]:
            block.counters["service_alive_ns"] = time.monotonic_ns()
    _note(folder, "service stopped")


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
