"""Serial adapters and python-can's interfaces that behave badly."""

from __future__ import annotations

import fcntl
import os
import pty
import select
import threading
import time
import tty
from collections.abc import Callable, Iterator

import can
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdpr_drivers.bus import BusHealth, BusState, BusUrl, bus_gone, open_port, open_python_can
from cdpr_drivers.bus.adapters.slcan import SlcanAdapter
from cdpr_drivers.bus.frames import EFF_FLAG, ERR_FLAG, FRAME, RTR_FLAG
from cdpr_drivers.errors import BusError
from tests.drivers.bus.port_frames import frame, open_files, receive


class Adapter:
    """The far end of a serial line; a thread answers commands by a table, frames are kept."""

    def __init__(self, answers: dict[bytes, bytes]) -> None:
        self.host, self.terminal = pty.openpty()
        tty.setraw(self.terminal)
        self.path = os.ttyname(self.terminal)
        self.answers = answers
        self.lines: list[bytes] = []
        self._out = threading.Event()
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    @property
    def url(self) -> BusUrl:
        return BusUrl.parse(f"slcan:{self.path}?bitrate=1000000")

    def _serve(self) -> None:
        rest = b""
        while not self._out.is_set():
            if not select.select([self.host], [], [], 0.02)[0]:
                continue
            rest += os.read(self.host, 4096)
            *lines, rest = rest.split(b"\r")
            for line in lines:
                self.lines.append(line)
                answer = self.answers.get(line, self.answers.get(line[:1], b""))
                os.write(self.host, answer)

    def say(self, text: bytes) -> None:
        os.write(self.host, text)

    def pull_out(self) -> None:
        """Take the adapter away: the end of the line."""
        if self._out.is_set():
            return
        self._out.set()
        self._thread.join()
        os.close(self.terminal)
        os.close(self.host)


GOOD = {b"C": b"\r", b"S": b"\r", b"O": b"\r", b"V": b"V1013\r", b"F": b"\a", b"t": b"z\r"}


@pytest.fixture
def start() -> Iterator[Callable[[dict[bytes, bytes]], Adapter]]:
    started: list[Adapter] = []

    def start(answers: dict[bytes, bytes]) -> Adapter:
        started.append(Adapter(answers))
        return started[-1]

    yield start
    for adapter in started:
        adapter.pull_out()


Start = Callable[[dict[bytes, bytes]], Adapter]


def test_an_adapter_is_opened_step_by_step(start: Start) -> None:
    adapter = start(GOOD)
    port = open_port(adapter.url)
    assert adapter.lines == [b"", b"C", b"V", b"S8", b"O", b"F"]
    port.close()
    deadline = time.monotonic() + 60.0
    while adapter.lines[-1] != b"C":
        assert time.monotonic() < deadline
        time.sleep(0.01)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({b"S": b"\a"}, r"refuses bit rate 1000000 \(S8\)"),
        ({b"O": b"\a"}, "refuses to open"),
        (dict.fromkeys(GOOD, b""), "nothing there answers as a serial CAN adapter"),
    ],
)
def test_an_adapter_that_will_not(start: Start, change: dict[bytes, bytes], message: str) -> None:
    adapter = start(GOOD | change)
    for opened in (open_port, open_python_can):
        with pytest.raises(BusError, match=message) as caught:
            opened(adapter.url)
        assert str(caught.value).count(adapter.path) == 1


def test_an_adapter_that_acknowledges_nothing_but_tells_its_version(start: Start) -> None:
    adapter = start({b"V": b"V1013\r"})
    port = open_port(adapter.url)
    port.settimeout(60.0)
    adapter.say(b"t1810\r")
    assert receive(port) == frame(0x181)
    port.close()


def test_late_answers_to_what_was_before_are_not_mistaken(start: Start) -> None:
    """A channel that was closed already refuses to close, and may say so late."""
    adapter = start(GOOD | {b"C": b"", b"V": b"\az\rt1810\r\aV1013\r"})
    open_port(adapter.url).close()


def test_frames_of_before_do_not_come_in(start: Start) -> None:
    adapter = start(GOOD)
    adapter.say(b"t7770\rt77")
    port = open_port(adapter.url)
    port.settimeout(60.0)
    adapter.say(b"t1811AA\r")
    assert receive(port) == frame(0x181, b"\xaa")
    assert port.drain() == 0
    port.close()


@given(st.lists(st.binary(max_size=30), max_size=10))
@settings(max_examples=200)
def test_rubbish_on_the_line_yields_frames_or_nothing(chunks: list[bytes]) -> None:
    adapter = SlcanAdapter.__new__(SlcanAdapter)
    adapter._reported_flags = 0
    for chunk in chunks:
        for kind in (b"", b"t", b"T", b"r", b"R", b"F"):
            got = adapter._frame_of(kind + chunk, b"\r")
            if got is not None:
                can_id, length, _ = FRAME.unpack(got)
                assert length <= 8
                assert can_id & ERR_FLAG or can_id & EFF_FLAG or can_id & ~RTR_FLAG < 0x1000


def test_rubbish_between_frames_loses_none(start: Start) -> None:
    adapter = start(GOOD)
    port = open_port(adapter.url)
    port.settimeout(60.0)
    adapter.say(b"t1810\r\xff\x00t99\rtXX81\rt1819\r\r\rhello\rt18")
    got = [receive(port)]  # so the line is read between the two pieces
    adapter.say(b"22ABCD12F0\rT000001811EE\rr1813\r")
    got += [receive(port) for _ in range(3)]
    assert got == [
        frame(0x181),
        frame(0x182, b"\xab\xcd"),  # with a time stamp
        frame(EFF_FLAG | 0x181, b"\xee"),
        FRAME.pack(RTR_FLAG | 0x181, 3, b""),
    ]
    port.close()


def test_a_line_cut_short_by_an_adapter_that_takes_nothing_is_ended_before_the_next(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    send_timeout = "cdpr_drivers.bus.adapters.slcan.SEND_TIMEOUT_S"
    monkeypatch.setattr(send_timeout, 0.2)
    host, terminal = pty.openpty()
    tty.setraw(terminal)
    adapter = SlcanAdapter.__new__(SlcanAdapter)  # on a channel that is open already
    adapter._fd, adapter._sending, adapter._partly_sent = terminal, threading.Lock(), False
    os.set_blocking(terminal, False)
    sent = frame(0x201, bytes(8))
    with pytest.raises(BlockingIOError):
        while True:
            adapter.write(sent)
    monkeypatch.setattr(send_timeout, 60.0)
    text = b""
    sending = threading.Thread(target=adapter.write, args=[frame(0x123, b"\x01")])
    sending.start()
    while not text.endswith(b"t123101\r"):  # it comes in as many pieces as the kernel likes
        assert select.select([host], [], [], 60.0)[0], text[-100:]
        text += os.read(host, 1 << 16)
    sending.join()
    *whole, piece, last, _ = text.split(b"\r")
    assert set(whole) == {b"t2018" + bytes(16).replace(b"\0", b"0")}
    assert last == b"t123101", piece
    os.close(host)
    os.close(terminal)


def test_trouble_the_adapter_tells_of_reaches_the_acyclic_side_only(
    start: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    # an adapter that does not tell its flags at first is never asked again
    monkeypatch.setattr(SlcanAdapter._command, "__defaults__", (60.0, b""))
    adapter = start(GOOD | {b"F": b"F00\r", b"t": b"\a"})
    cyclic, acyclic = open_port(adapter.url), open_python_can(adapter.url, [(0x701, 0x7FF)])
    health = BusHealth()

    def told() -> None:
        message = acyclic.recv(60.0)
        assert message is not None
        assert message.is_error_frame
        health.take_error(message.arbitration_id, bytes(message.data))

    cyclic.send(frame(0x201))
    told()
    assert "transmit buffer" in health.text
    adapter.answers[b"F"] = b"FA4\r"
    told()
    assert health.state is BusState.PASSIVE
    adapter.answers[b"F"] = b"F00\r"
    told()
    while health.state is not BusState.ACTIVE:
        told()
    assert health.errors >= 2
    cyclic.settimeout(0.01)
    with pytest.raises(BlockingIOError):
        cyclic.recv_into(bytearray(16))
    cyclic.close()
    acyclic.shutdown()


def test_one_adapter_serves_all_who_open_it(start: Start) -> None:
    adapter = start(GOOD)
    ports = [open_port(adapter.url, [(0x180, 0x780)]), open_port(adapter.url)]
    bus = open_python_can(adapter.url, [(0x701, 0x7FF)])
    for port in ports:
        port.settimeout(60.0)
    adapter.say(b"t7010\rt1810\r")
    assert receive(ports[0]) == frame(0x181)
    assert [receive(ports[1]) for _ in range(2)] == [frame(0x701), frame(0x181)]
    message = bus.recv(60.0)
    assert message is not None
    assert message.arbitration_id == 0x701
    ports[0].send(frame(0x701, b"\x05"))  # the others hear it, as on SocketCAN
    message = bus.recv(60.0)
    assert message is not None
    assert bytes(message.data) == b"\x05"
    assert receive(ports[1]) == frame(0x701, b"\x05")
    assert ports[0].drain() == 0
    with pytest.raises(BusError, match="is in use with other settings"):
        open_port(BusUrl.parse(f"slcan:{adapter.path}?bitrate=500000"))
    ports[0].close()
    ports[0].close()
    adapter.say(b"t1820\r")
    assert receive(ports[1]) == frame(0x182)
    with pytest.raises(OSError, match="closed"):
        ports[0].send(frame(0x80))
    ports[1].close()
    bus.shutdown()
    assert not [t for t in threading.enumerate() if t.name.startswith("reads slcan")]


def test_pulled_out_it_is_noticed_by_all_and_can_come_back(start: Start) -> None:
    adapter = start(GOOD)
    port, bus = open_port(adapter.url), open_python_can(adapter.url)
    port.settimeout(3600.0)
    adapter.pull_out()
    assert port.recv_into(bytearray(16)) == 0
    told = f"{adapter.url}: the bus has gone away (the serial adapter has been pulled out"
    assert told in str(port.lost())
    with pytest.raises(OSError, match="pulled out") as caught:
        port.send(frame(0x80))
    assert told in str(port.lost(caught.value))
    with pytest.raises(can.CanError, match="pulled out"):
        bus.recv(1.0)
    with pytest.raises(can.CanError, match="pulled out"):
        bus.send(can.Message(arbitration_id=0x80, is_extended_id=False))
    # nothing holds its name, which the next one may be given
    assert not [name for name in open_files() if name.startswith(adapter.path)]
    port.close()
    bus.shutdown()


def test_a_port_in_use_by_another_program(start: Start) -> None:
    adapter = start(GOOD)
    with open(adapter.path, "rb", buffering=0) as other:  # noqa: PTH123  # a terminal
        fcntl.flock(other, fcntl.LOCK_EX | fcntl.LOCK_NB)
        with pytest.raises(BusError, match="is in use by another program"):
            open_port(adapter.url)


@pytest.mark.parametrize(
    ("url", "message"),
    [
        ("slcan:/dev/ttyNOTHING?bitrate=1000000", "there is no serial port /dev/ttyNOTHING"),
        ("slcan:/dev/null?bitrate=1000000", "/dev/null is no serial port"),
        ("slcan:/tmp?bitrate=1000000", "/tmp is no serial port"),
        ("slcan:/dev/ptmx?bitrate=123456", "bitrate 123456: allowed are 10000, "),
        ("slcan:/dev/ptmx?bitrte=1000000", "unknown option 'bitrte'; allowed: bitrate, "),
        ("slcan:/dev/ptmx?tty_baudrate=fast", "tty_baudrate 'fast': this port cannot be set"),
        ("socketcand://127.0.0.1:1/can0", r"no socketcand server at 127\.0\.0\.1:1 \(Connection"),
        ("socketcand://127.0.0.1:1/can0?speed=1", "unknown option 'speed'"),
        ("simbus:nobody-is-home", "no simulated bus of that name is running"),
        ("udp_multicast:no-address", "cannot be opened"),
    ],
)
def test_a_bus_that_cannot_be_opened_is_told_once(url: str, message: str) -> None:
    for opened in (open_port, open_python_can):
        with pytest.raises(BusError, match=message) as caught:
            opened(BusUrl.parse(url))
        assert str(caught.value).count(url.split("?", maxsplit=1)[0]) == 1


def test_a_lost_bus_is_told_once_whoever_tells_it() -> None:
    url = BusUrl.parse("simbus:one")
    for error in (
        can.CanOperationError("simbus:one: the bus has gone away (connection closed)"),
        can.CanOperationError("connection closed"),
    ):
        assert str(bus_gone(url, error)) == "simbus:one: the bus has gone away (connection closed)"


def test_two_ports_on_any_other_interface_share_one_bus() -> None:
    url = BusUrl.parse("virtual:line-adapters")
    one, two = open_port(url), open_port(url, [(0x181, 0x7FF)])
    with can.Bus("line-adapters", interface="virtual") as third_party:
        two.settimeout(60.0)
        one.send(frame(0x181, b"ours"))
        third_party.send(can.Message(arbitration_id=0x181, data=b"theirs", is_extended_id=False))
        assert [receive(two), receive(two)] == [frame(0x181, b"ours"), frame(0x181, b"theirs")]
        message = third_party.recv(60.0)
        assert message is not None
        assert bytes(message.data) == b"ours"
    one.close()
    two.close()


def test_frames_a_port_does_not_read_in_time_are_counted() -> None:
    url, health = BusUrl.parse("virtual:line-overflow"), BusHealth()
    slow, sender = open_port(url, None, health), open_port(url, [])
    sent = 0
    while not health.rx_lost:
        assert sent < 500_000
        sender.send(frame(0x181))
        sent += 1
    assert slow.drain() == sent - health.rx_lost
    slow.close()
    sender.close()
