"""A service on real sockets, in a thread, over a loop that tests control."""

from __future__ import annotations

import asyncio
import contextlib
import os
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import numpy as np
from waiting import until

from cdpr_rt.core.shared_block import RowWriter, SharedBlock
from cdpr_rt.core.states import LoopState
from cdpr_rt.service.access_control import AccessControl, AccessPolicy
from cdpr_rt.service.http_app import create_app
from cdpr_rt.service.http_server import Server
from cdpr_rt.service.lease import LeaseError
from cdpr_rt.service.listening import listen_tcp, listen_unix
from cdpr_rt.service.service import Service

KEY = b"an old key that opens this daemon"
AXES = ("left", "right")
NOT_TIGHT = {"code": "not_tight", "command": "pose", "asked": {}, "arguments": {}}
"""Why the loop does not run the program `pose`."""


class MadeUpLoop:
    """Takes and records commands as the loop does, and writes rows while it `turns`."""

    def __init__(self, block: SharedBlock) -> None:
        self.block = block
        self.commands: list[dict[str, Any]] = []
        self.answers = True
        self.turns = True
        self._turning = threading.Lock()
        self.status: dict[str, Any] = {
            "state": "ready",
            "program": "idle",
            "reason": "",
            "notices": [],
        }
        block.counters["loop_pid"] = os.getpid()
        block.counters["start_monotonic_ns"] = time.monotonic_ns()
        block.counters["start_realtime_ns"] = time.time_ns()
        block.write_description(
            {"axes": [{"name": name} for name in AXES], "programs": ["idle", "hold", "jog"]}
        )
        block.write_status(self.status)
        self._rows = RowWriter(block)
        self._cycle = 0

    def run(self, ended: threading.Event) -> None:
        while not ended.wait(0.002):
            with self._turning:
                if self.turns:
                    self.turn()

    def stand_still(self) -> None:
        """Stop turning."""
        with self._turning:
            self.turns = False

    def turn(self) -> None:
        self.block.counters["loop_alive_ns"] = time.monotonic_ns()
        take = (self.block.take_urgent, self.block.take_command)
        while self.answers and (command := take[0]() or take[1]()) is not None:
            self.commands.append(command)
            self.block.post_reply({"to": command["number"], **self._obey(command)})
        row = self._rows.slot()
        row["cycle"] = self._cycle = self._cycle + 1
        row["state"] = LoopState.READY
        row["compute_s"] = 1e-4
        row["position_rad"] = np.arange(len(AXES))
        row["tension_N"] = np.nan
        self._rows.commit()

    def _obey(self, command: dict[str, Any]) -> dict[str, Any]:
        if command["do"] == "check":
            return {"ok": False, "text": "check: node 3 does not answer", "state": "inactive"}
        if command["do"] == "program" and command["program"] == "pose":
            text = "pose: the cables are not tight; run tighten first"
            return {"ok": False, "text": text, "refusal": NOT_TIGHT, "state": "ready"}
        if command.get("stops", self.block.stops) != self.block.stops:
            text = f"{command['do']}: cancelled by a later stop"
            return {"ok": False, "text": text, "state": str(self.status["state"])}
        if command["do"] == "enable":
            self.publish(state="active", program=command["program"])
        return {"ok": True, "text": "", "state": str(self.status["state"])}

    def publish(self, **values: Any) -> None:
        self.status = {**self.status, **values}
        self.block.write_status(self.status)


class Rig:
    """The service, its addresses, and clients of it."""

    def __init__(self, folder: Path) -> None:
        self.block = SharedBlock.create(len(AXES), 1.0, 500.0)
        self.loop = MadeUpLoop(self.block)
        self.socket = folder / "control.sock"
        self.port = self.guarded_port = 0
        self._ended = threading.Event()
        self._up = threading.Event()
        self._threads = [
            threading.Thread(target=self.loop.run, args=(self._ended,)),
            threading.Thread(target=lambda: asyncio.run(self._serve())),
        ]

    def start(self) -> None:
        """Start the service, and the loop once all of its rows are seen."""
        turning, serving = self._threads
        serving.start()
        assert self._up.wait(60.0)
        turning.start()

    def stop(self) -> None:
        self._ended.set()
        for thread in self._threads:
            thread.join()

    def reset(self) -> None:
        """Restore the initial state, except for events and the count of cycles."""
        loop, lease = self.loop, self.service.lease
        loop.answers = loop.turns = True
        time.sleep(0.05)
        with contextlib.suppress(LeaseError):
            lease.release(lease._token)
        loop.publish(state="ready", program="idle", reason="", reason_limit=None)
        loop.commands.clear()

    async def _serve(self) -> None:
        self.service = service = Service(self.block, "bench")
        app = create_app(service)
        plain, guarded = listen_tcp("127.0.0.1", 0), listen_tcp("127.0.0.1", 0)
        self.port, self.guarded_port = plain.getsockname()[1], guarded.getsockname()[1]
        policies = {
            listen_unix(self.socket): AccessPolicy(local=True),
            plain: AccessPolicy.on_tcp(None, "127.0.0.1"),
            guarded: AccessPolicy.on_tcp(KEY, "127.0.0.1"),
        }
        servers = [
            Server(
                AccessControl(
                    app,
                    policy,
                    service.count_refusal,
                    service.lease.is_held_by,
                    service.tickets,
                    lambda: self.block.stops,
                ),
                listener,
            )
            for listener, policy in policies.items()
        ]
        serving = [asyncio.create_task(server.serve_until_stopped()) for server in servers]
        watching = asyncio.create_task(service.watch())
        while not all(server.started for server in servers):
            await asyncio.sleep(0.01)
        self._up.set()
        while not self._ended.is_set():
            await asyncio.sleep(0.02)
            assert not watching.done()
        for server in servers:
            server.should_exit = True
        await asyncio.gather(*serving)
        watching.cancel()

    def client(self) -> httpx.Client:
        transport = httpx.HTTPTransport(uds=str(self.socket))
        return httpx.Client(transport=transport, base_url="http://robot", timeout=60.0)

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    @property
    def guarded_url(self) -> str:
        return f"http://127.0.0.1:{self.guarded_port}"

    @property
    def lease_until_s(self) -> float:
        return int(self.block.counters["right_until_ns"][0]) * 1e-9

    @property
    def lease_left_s(self) -> float:
        return self.lease_until_s - time.monotonic()

    def wait_for_renewal(self, by_s: float) -> None:
        """Wait until the right holds for `by_s` longer than now."""
        now_s = self.lease_until_s
        until(lambda: self.lease_until_s > now_s + by_s)


@contextmanager
def running(folder: Path) -> Iterator[Rig]:
    rig = Rig(folder)
    rig.start()
    try:
        yield rig
    finally:
        rig.stop()


def raw(rig: Rig, text: bytes, wait_s: float = 5.0, port: int = 0) -> bytes:
    """Send bytes and return those received until the other side closed or paused."""
    with socket.create_connection(("127.0.0.1", port or rig.port), wait_s) as sock:
        sock.sendall(text)
        sock.settimeout(wait_s)
        try:
            return sock.recv(65536)
        except (TimeoutError, ConnectionResetError):
            return b""


def reachable(rig: Rig) -> bool:
    try:
        return httpx.get(f"{rig.url}/status", timeout=60.0).status_code == 200
    except httpx.HTTPError:
        return False
