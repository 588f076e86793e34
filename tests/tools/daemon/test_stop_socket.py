"""The stop socket of a real loop on simulated drives."""

from __future__ import annotations

import array
import json
import socket
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from cdpr_rt.core.states import LoopState
from cdpr_rt.loop.stop_socket import StopSocket, StopUnansweredError, send_stop
from tests.tools.daemon.loop_rig import LoopRig, opened
from tests.tools.robot_rig import robot_file, simulated

WAIT_S = 60.0
JOG = {"program": "jog", "wanted": {"velocity_rad_s": [0.5], "timeout_s": 2.0}}


@pytest.fixture(scope="module")
def socket_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("run") / "robot.stop"


@pytest.fixture(scope="module")
def loop(socket_path: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[LoopRig]:
    path = robot_file(tmp_path_factory.mktemp("robot"), [("can0", 1)], period_s=2e-3)
    with simulated(path) as url, opened(path, url, stops=StopSocket(socket_path)) as rig:
        yield rig


@pytest.fixture
def jogging(loop: LoopRig) -> LoopRig:
    """Return a jogging loop with an empty queue of replies."""
    if loop.state is LoopState.READY:
        loop.obeyed("enable")
    loop.turn_until(lambda: not loop.loop.busy)
    loop.obeyed("program", **JOG)
    return loop


def send(path: Path, data: bytes, *fds: int) -> None:
    """Send a datagram with file descriptors."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sock:
        sock.connect(str(path))
        sock.sendmsg([data], [(socket.SOL_SOCKET, socket.SCM_RIGHTS, array.array("i", fds))])


def descriptors() -> set[tuple[str, str]]:
    """Return the open descriptors of this process, each with what it refers to."""
    found = set()
    for path in Path("/proc/self/fd").iterdir():
        with suppress(OSError):  # of the list itself, which is closed again
            found.add((path.name, str(path.readlink())))
    return found


@contextmanager
def asking(path: Path, do: str, client: str = "test") -> Iterator[Future[Any]]:
    """Request a stop from another thread."""
    with ThreadPoolExecutor(1) as pool:
        yield pool.submit(send_stop, path, do, client, WAIT_S)


def test_a_hold_stops_the_motion_and_is_answered_and_reported(
    jogging: LoopRig, socket_path: Path
) -> None:
    with asking(socket_path, "hold", "maria@lab") as answer:
        jogging.turn_until(answer.done)
    assert answer.result() == {"ok": True, "text": "", "state": "active"}
    assert jogging.loop.engine.program.name == "hold"
    stops = jogging.block.status()["stops"]
    assert (stops["do"], stops["client"]) == ("hold", "maria@lab")


def test_commands_queued_before_a_stop_do_not_move_after_it(
    jogging: LoopRig, socket_path: Path
) -> None:
    block = jogging.block
    for _ in range(10):
        block.post_command({"do": "program", "client": "test", "right": jogging.right, **JOG})
    send(socket_path, b'{"do": "hold"}')
    jogging.turn(20)
    assert jogging.loop.engine.program.name == "hold"
    while (reply := block.take_reply()) is not None:
        assert "cancelled by a later stop" in reply["text"]
    jogging.obeyed("program", **JOG)  # later commands are accepted again
    assert jogging.loop.engine.program.name == "jog"


def test_a_command_requested_before_a_stop_and_posted_after_it_does_not_move(
    jogging: LoopRig, socket_path: Path
) -> None:
    before = jogging.block.stops
    send(socket_path, b'{"do": "hold"}')
    jogging.turn(2)
    refused = jogging.command("program", **JOG, stops=before)
    assert refused["text"] == "program: cancelled by a later stop"
    assert jogging.loop.engine.program.name == "hold"


def test_a_stop_while_enable_checks_its_files_leaves_the_power_off(
    loop: LoopRig, monkeypatch: pytest.MonkeyPatch
) -> None:
    if loop.state is LoopState.ACTIVE:
        loop.obeyed("disable")
    engine = loop.loop.engine
    parts = replace(engine.parts, before_power=loop.block.count_stop)
    monkeypatch.setattr(engine, "parts", parts)
    assert loop.command("enable")["text"] == "enable: cancelled by a later stop"
    loop.turn_until(lambda: not loop.loop.busy)
    assert loop.state is LoopState.READY


def test_disable_is_answered_when_power_is_off_and_is_idempotent(
    jogging: LoopRig, socket_path: Path
) -> None:
    with asking(socket_path, "disable") as one, asking(socket_path, "disable") as other:
        jogging.turn_until(lambda: one.done() and other.done())
    for answer in (one.result(), other.result()):
        assert (answer["ok"], answer["state"]) == (True, "ready")
    assert jogging.state is LoopState.READY


def test_a_rejection_is_answered_with_its_code(loop: LoopRig, socket_path: Path) -> None:
    if loop.state is LoopState.ACTIVE:
        loop.obeyed("disable")
    with asking(socket_path, "hold") as answer:
        loop.turn_until(answer.done)
    assert not answer.result()["ok"]
    assert answer.result()["refusal"]["code"] == "not_in_state"


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"{",
        b"\xff\xfe",
        b"7",
        b"null",
        b"[" * 1000,
        b'{"do": "enable", "client": "test"}',
        b'{"do": ["hold"]}',
        json.dumps({"do": "hold", "client": "x" * 5000}).encode(),
    ],
)
def test_invalid_datagrams_are_ignored_without_leaking_descriptors(
    jogging: LoopRig, socket_path: Path, data: bytes
) -> None:
    before = descriptors()
    send(socket_path, data)
    send(socket_path, data, 0, 0, 0)
    jogging.turn(5)
    assert jogging.loop.engine.program.name == "jog"
    assert not descriptors() - before
    with asking(socket_path, "hold") as answer:
        jogging.turn_until(answer.done)
    assert answer.result()["ok"]


def test_a_stop_is_obeyed_although_its_sender_has_ended(
    jogging: LoopRig, socket_path: Path
) -> None:
    with pytest.raises(StopUnansweredError):
        send_stop(socket_path, "hold", "impatient", 0.01)
    jogging.turn(2)
    assert jogging.loop.engine.program.name == "hold"


def test_a_flood_of_stops_is_obeyed_with_few_open_descriptors(
    jogging: LoopRig, socket_path: Path
) -> None:
    jogging.obeyed("program", program="jog", wanted={"velocity_rad_s": [5.0], "timeout_s": 2.0})
    jogging.turn(400)  # fast motion, so that the stop takes longer than 32 requests
    before = descriptors()
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with ours, theirs:
        for _ in range(100):
            send(socket_path, b'{"do": "disable"}', theirs.fileno())
            jogging.turn(1)
        assert len(descriptors() - before) < 40
        answer = json.loads(ours.recv(1024))
        assert answer["ok"] and "its end is not reported" in answer["text"], answer
        assert answer["state"] == "active"
        jogging.turn_until(lambda: jogging.state is LoopState.READY)
    assert not descriptors() - before


def test_a_waiting_client_is_answered_when_the_loop_ends(tmp_path: Path) -> None:
    path = tmp_path / "robot.stop"
    assert send_stop(path, "hold", "test", WAIT_S) is None
    stops = StopSocket(path)
    assert path.stat().st_mode & 0o777 == 0o600
    with asking(path, "hold") as answer:
        while stops.take() is None:
            assert not answer.done()
        stops.close()
        assert answer.result(WAIT_S) is None
