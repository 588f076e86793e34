"""The simulator as a separate process, and its gateways with third-party clients."""

from __future__ import annotations

import contextlib
import json
import os
import re
import select
import signal
import socket
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import can
import pytest
import serial
from fork_server import FORKED

NAME = f"gateways-{os.getpid()}"
SIMULATOR = """
import math, pathlib, sys
from cdpr_sim_bus.clock import ClockMode
from cdpr_sim_bus.errors import SimulatorError
from cdpr_sim_bus.frame import pack_frame
from cdpr_sim_bus.bus.server import serve

class Node:
    node_id, sync_period_s, accepts = 1, 0.001, None
    def __init__(self): self.outbox = [pack_frame(0x701, b"\\0")]
    def receive(self, frame, now):
        if frame[:2] == b"\\x80\\x00":
            self.outbox += [pack_frame(0x181, b"12345678"), pack_frame(0x281)]
    def advance(self, now): pass
    def next_event(self): return math.inf
    def close(self): pathlib.Path(sys.argv[2]).write_text("closed")

gateways = {"slcan": True, "socketcand_port": int(sys.argv[3])} if sys.argv[3] else {}
mode = ClockMode.LOCKSTEP if gateways else ClockMode.PACED
try:
    serve([Node()], sys.argv[1], mode=mode, until_stdin_ends=True, **gateways)
except SimulatorError as error:
    sys.exit(str(error))
"""


class Simulator:
    """A bus that answers SYNC: in lockstep with both gateways, or paced without gateways."""

    def __init__(self, bus: str, port: int | None = 0, trace: Path = Path(os.devnull)) -> None:
        self.process = subprocess.Popen(
            [*FORKED, SIMULATOR, bus, str(trace), "" if port is None else str(port)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        self.ready: dict[str, Any] = json.loads(line)["ready"] if line else {}

    @property
    def port(self) -> int:
        return int(re.split(r"[:/]", self.ready["socketcand"])[4])

    def stop(self) -> tuple[int, str]:
        _, errors = self.process.communicate(timeout=120)
        return self.process.returncode, errors


@pytest.fixture(scope="module")
def simulator() -> Iterator[Simulator]:
    running = Simulator(f"simbus:{NAME}")
    with can.Bus(NAME, interface="simbus") as bus:
        bus.send(can.Message(arbitration_id=0x080, is_extended_id=False))
        while frames(bus, 1)[0][0] != 0x281:  # by then the boot-up message has passed
            pass
    yield running
    assert running.stop() == (0, "")


@pytest.fixture
def member(simulator: Simulator) -> Iterator[can.BusABC]:
    with can.Bus(NAME, interface="simbus") as bus:
        yield bus


@pytest.fixture
def line(simulator: Simulator) -> Iterator[serial.Serial]:
    """Yield the adapter's serial line with a closed channel and no earlier answers.

    An earlier user may have left before its answers arrived. Input before the version is such an
    answer.
    """
    with serial.Serial(simulator.ready["slcan"], timeout=60.0) as port:
        port.write(b"\rC\rV\r")
        assert port.read_until(b"V1013\r").endswith(b"V1013\r")
        yield port
        if port.is_open:
            port.write(b"C\r")


@pytest.fixture
def stock_slcan(simulator: Simulator, line: serial.Serial) -> Iterator[can.BusABC]:
    line.close()
    with can.Bus(
        simulator.ready["slcan"], interface="slcan", bitrate=1_000_000, sleep_after_open=0.1
    ) as bus:
        yield bus


@pytest.fixture
def stock_socketcand(simulator: Simulator) -> Iterator[can.BusABC]:
    with can.Bus(NAME, interface="socketcand", host="127.0.0.1", port=simulator.port) as bus:
        time.sleep(0.05)  # the server pauses after the greeting
        yield bus


def frames(bus: can.BusABC, count: int) -> list[tuple[int, bool, bool, bytes]]:
    """Return the received frames: up to `count`, each within two seconds."""
    seen = []
    while len(seen) < count:
        message = bus.recv(60.0)
        assert message is not None
        seen.append(
            (
                message.arbitration_id,
                message.is_extended_id,
                message.is_remote_frame,
                bytes(message.data),
            )
        )
    return seen


SENT = [
    can.Message(arbitration_id=0x123, data=b"abc", is_extended_id=False),
    can.Message(arbitration_id=0x18FF1234, data=b"12345678", is_extended_id=True),
    can.Message(arbitration_id=0x7FF, data=b"", is_extended_id=False),
]
REMOTE = can.Message(arbitration_id=0x701, is_remote_frame=True, dlc=1, is_extended_id=False)


def wire(message: can.Message) -> tuple[int, bool, bool, bytes]:
    return (
        message.arbitration_id,
        message.is_extended_id,
        message.is_remote_frame,
        bytes(message.data),
    )


@pytest.mark.parametrize("gateway", ["stock_slcan", "stock_socketcand"])
def test_third_party_clients_exchange_frames_with_the_bus(
    gateway: str, member: can.BusABC, request: pytest.FixtureRequest
) -> None:
    bus = request.getfixturevalue(gateway)
    sent = [*SENT, REMOTE] if gateway == "stock_slcan" else SENT
    expected = [wire(message) for message in sent]
    for message in sent:
        bus.send(message)
    assert frames(member, len(sent)) == expected
    for message in sent:
        member.send(message)
    # python-can does not return what it takes for answers to its commands
    assert frames(bus, len(sent)) == expected


def test_the_serial_line_takes_the_time_of_its_characters(line: serial.Serial) -> None:
    """At 1 Mbaud a character takes 10 us. 200 frames of 23 characters and answers take 46 ms."""
    line.write(b"S8\rO\r")
    assert line.read(2) == b"\r\r"
    started = time.monotonic()
    line.write(b"t30181122334455667788\r" * 200)
    answers = line.read(400)
    took = time.monotonic() - started
    assert answers == b"z\r" * 200
    assert took > 200 * 22 * 10e-6


def test_an_adapter_whose_line_is_not_read_loses_frames_and_keeps_working(
    line: serial.Serial, member: can.BusABC
) -> None:
    line.write(b"S8\rO\r")
    assert line.read(2) == b"\r\r"
    end = time.monotonic() + 60.0
    flags = 0
    while not flags & 0x09:  # frames arrive until the flags have reported the loss once
        assert time.monotonic() < end, f"{flags:02X}"
        for _ in range(1500):
            member.send(can.Message(arbitration_id=0x301, data=bytes(8), is_extended_id=False))
        line.reset_input_buffer()
        line.write(b"F\r")
        text = b""
        while b"F" not in text:
            part = line.read_until(b"\r")
            assert part
            text += part
        flags = int(re.search(rb"F(..)\r", text)[1], 16)  # type: ignore[index]  # it holds F


# -- socketcand, by hand


class Talk:
    """A raw connection to the server."""

    def __init__(self, port: int) -> None:
        self.sock = socket.create_connection(("127.0.0.1", port), 60.0)
        self.expect("< hi >")

    def expect(self, text: str) -> None:
        got = b""
        while len(got) < len(text):
            part = self.sock.recv(len(text) - len(got))
            assert part, got
            got += part
        assert got.decode() == text

    def say(self, text: str, answer: str) -> None:
        self.sock.sendall(text.encode())
        self.expect(answer)


@pytest.fixture
def talk(simulator: Simulator) -> Iterator[Talk]:
    talk = Talk(simulator.port)
    yield talk
    talk.sock.close()


def test_socketcand_commands_get_the_expected_answers(talk: Talk, member: can.BusABC) -> None:
    talk.say("< echo >", "< echo >")
    talk.say("< rawmode >", "< error no bus is open >")
    talk.say("< open nobus9 >", "< error could not open bus >")
    talk.say("< open can0 >", "< ok >")
    talk.say("< open can0 >", "< error a bus is open already >")
    talk.say("< send 123 3 1 2 >", "< error malformed send command >")
    talk.say("< send 1234 0  >", "< error malformed send command >")
    talk.say("< send FFF 0  >", "< error malformed send command >")
    talk.say("< dance >", "< error unknown command >")
    talk.say("x" * 300, "< error command too long >")
    talk.say("< rawmode >", "< ok >")
    member.send(can.Message(arbitration_id=0x080, is_extended_id=False))
    talk.expect("< frame 080 ")
    rest = b""
    while rest.count(b">") < 3:
        rest += talk.sock.recv(4096)
    texts = re.findall(r"\d+\.\d{6} [^<]*", rest.decode())
    assert [text.split(" ", 1)[1] for text in texts] == [" >", "3132333435363738 >", " >"]


def test_socketcand_commands_may_be_split_anywhere(talk: Talk, member: can.BusABC) -> None:
    for character in "< open can0 >":
        talk.sock.sendall(character.encode())
    talk.expect("< ok >")
    for character in "noise < send 201 4 0f 0 F4 1 >< send 00000201 0  >":
        talk.sock.sendall(character.encode())
    assert frames(member, 2) == [
        (0x201, False, False, b"\x0f\x00\xf4\x01"),
        (0x201, True, False, b""),
    ]


def test_a_client_that_leaves_or_does_not_read_does_not_affect_others(
    simulator: Simulator, member: can.BusABC
) -> None:
    deaf, gone = Talk(simulator.port), Talk(simulator.port)
    for talk in (deaf, gone):
        talk.say("< open can0 >", "< ok >")
        talk.say("< rawmode >", "< ok >")
    gone.sock.close()
    for _ in range(20_000):
        with contextlib.suppress(can.CanError):
            member.send(can.Message(arbitration_id=0x301, data=bytes(8), is_extended_id=False))
    third = Talk(simulator.port)
    third.say("< echo >", "< echo >")
    deaf.sock.close()
    third.sock.close()


# -- start and end of the gateways


def test_a_port_in_use_is_reported(simulator: Simulator) -> None:
    second = Simulator(f"simbus:{NAME}-2", simulator.port)
    status, errors = second.stop()
    assert status == 1
    assert f"socketcand server on 127.0.0.1:{simulator.port}: Address already in use" in errors
    assert "Traceback" not in errors


def test_gateways_on_a_real_interface_are_rejected() -> None:
    status, errors = Simulator("socketcan:nocan9").stop()
    assert status == 1
    assert "'socketcan:nocan9': --slcan and --socketcand are for simbus:NAME only" in errors
    assert "Traceback" not in errors


@pytest.mark.parametrize("way", [signal.SIGTERM, signal.SIGKILL])
def test_the_gateways_end_with_the_simulator(way: signal.Signals) -> None:
    running = Simulator(f"simbus:{NAME}-3")
    pids = [running.ready["slcan_pid"], running.ready["socketcand_pid"]]
    handles = [os.pidfd_open(pid) for pid in pids]
    running.process.send_signal(way)
    running.process.communicate(timeout=120)
    for handle in handles:
        assert select.select([handle], [], [], 60.0)[0]
        os.close(handle)


# -- without gateways


@pytest.fixture
def trace(tmp_path: Path) -> Path:
    return tmp_path / "trace"


@pytest.fixture
def plain(trace: Path) -> Iterator[Simulator]:
    simulator = Simulator(f"simbus:{NAME}-4", None, trace)
    yield simulator
    simulator.process.kill()
    simulator.process.wait()


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_ends_the_simulator_properly(
    plain: Simulator, trace: Path, number: signal.Signals
) -> None:
    assert (plain.ready["bus"], plain.ready["pid"]) == (f"simbus:{NAME}-4", plain.process.pid)
    assert (plain.ready["mode"], plain.ready["nodes"]) == ("paced", [1])
    plain.process.send_signal(number)
    assert plain.stop() == (0, "")
    assert trace.read_text() == "closed"


@pytest.mark.parametrize(
    ("bus", "message"),
    [
        (f"simbus:{NAME}", "is in use by another simulator"),
        ("slcan:/dev/ttyACM0", "run on simbus:NAME or socketcan:IFACE"),
        ("simbus:", "allowed: 1 to 64"),
        ("socketcan:nocan9", "socketcan:nocan9"),
    ],
    ids=["taken", "adapter", "unnamed", "no-interface"],
)
def test_a_bus_that_cannot_be_served_is_rejected(
    simulator: Simulator, bus: str, message: str
) -> None:
    status, errors = Simulator(bus, None).stop()
    assert status == 1
    assert message in errors
    assert "Traceback" not in errors
