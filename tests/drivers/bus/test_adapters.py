"""Serial adapters, socketcand servers and interfaces of python-can, some of them misbehaving."""

from __future__ import annotations

import fcntl
import os
import pty
import select
import socket
import threading
import time
import tty
from collections.abc import Callable, Iterator

import can
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from waiting import until

from cdpr_drivers.bus import BusHealth, BusState, BusUrl, FramePort, open_port
from cdpr_drivers.bus.frames import EFF_FLAG, ERR_FLAG, FRAME, RTR_FLAG
from cdpr_drivers.bus.slcan import SlcanAdapter
from cdpr_drivers.bus.socketcand import SocketcandAdapter
from cdpr_drivers.errors import BusError
from tests.drivers.bus.port_frames import GREETING, Server, frame, open_files, receive


def opened(url: BusUrl, filters: list[tuple[int, int]] | None = None) -> FramePort:
    """Return a port that receives error frames too and waits up to 60 s for a frame."""
    port = open_port(url, filters, receive_errors=True)
    port.settimeout(60.0)
    return port


# -- serial adapters


class Adapter:
    """The far end of a serial line. A thread answers commands from a table and keeps frames."""

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
        """Unplug the adapter: close the line."""
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


def test_an_adapter_is_opened_with_the_expected_commands(start: Start) -> None:
    adapter = start(GOOD)
    port = open_port(adapter.url)
    assert adapter.lines == [b"", b"C", b"V", b"S8", b"O", b"F"]
    port.close()
    until(lambda: adapter.lines[-1] == b"C")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({b"S": b"\a"}, r"rejects bit rate 1000000 \(S8\)"),
        ({b"O": b"\a"}, "rejects the command to open"),
        (dict.fromkeys(GOOD, b""), "no serial CAN adapter"),
    ],
)
def test_a_command_rejected_by_the_adapter_is_reported(
    start: Start, change: dict[bytes, bytes], message: str
) -> None:
    adapter = start(GOOD | change)
    with pytest.raises(BusError, match=message) as caught:
        open_port(adapter.url)
    assert str(caught.value).count(adapter.path) == 1


@pytest.mark.parametrize("version", [b"V1013\r", b"b158aa7 git@example.org:fw.git\r"])
def test_an_adapter_that_only_answers_the_version_query_is_accepted(
    start: Start, version: bytes
) -> None:
    adapter = start({b"V": version})
    port = opened(adapter.url)
    adapter.say(b"t1810\r")
    assert receive(port) == frame(0x181)
    port.close()


def test_late_answers_to_earlier_commands_are_ignored(start: Start) -> None:
    """A channel that is already closed rejects the close command, maybe late."""
    adapter = start(GOOD | {b"C": b"", b"V": b"\az\rt1810\r10AB\r\aV1013\r"})
    open_port(adapter.url).close()


def test_frames_from_before_opening_are_discarded(start: Start) -> None:
    adapter = start(GOOD)
    adapter.say(b"t7770\rt77")
    port = opened(adapter.url)
    adapter.say(b"t1811AA\r")
    assert receive(port) == frame(0x181, b"\xaa")
    assert port.drain() == 0
    port.close()


@given(st.lists(st.binary(max_size=30), max_size=10))
@settings(max_examples=200)
def test_garbage_on_the_line_yields_valid_frames_or_nothing(chunks: list[bytes]) -> None:
    adapter = SlcanAdapter.__new__(SlcanAdapter)
    adapter._reported_flags = 0
    for chunk in chunks:
        for kind in (b"", b"t", b"T", b"r", b"R", b"F"):
            got = adapter._frame_of(kind + chunk, b"\r")
            if got is not None:
                can_id, length, _ = FRAME.unpack(got)
                assert length <= 8
                assert can_id & ERR_FLAG or can_id & EFF_FLAG or can_id & ~RTR_FLAG < 0x1000


def test_garbage_between_frames_loses_no_frame(start: Start) -> None:
    adapter = start(GOOD)
    port = opened(adapter.url)
    adapter.say(b"t1810\r\xff\x00t99\rtXX81\rt1819\r\r\rhello\rt18")
    got = [receive(port)]  # the line is read between the two pieces
    adapter.say(b"22ABCD12F0\rT000001811EE\rr1813\r")
    got += [receive(port) for _ in range(3)]
    assert got == [
        frame(0x181),
        frame(0x182, b"\xab\xcd"),  # with a time stamp
        frame(EFF_FLAG | 0x181, b"\xee"),
        FRAME.pack(RTR_FLAG | 0x181, 3, b""),
    ]
    port.close()


def test_a_partly_sent_frame_is_completed_before_the_next_one(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    send_timeout = "cdpr_drivers.bus.slcan.SEND_TIMEOUT_S"
    monkeypatch.setattr(send_timeout, 0.2)
    host, terminal = pty.openpty()
    tty.setraw(terminal)
    adapter = SlcanAdapter.__new__(SlcanAdapter)  # as if the channel were open
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
    while not text.endswith(b"t123101\r"):  # in any number of pieces
        assert select.select([host], [], [], 60.0)[0], text[-100:]
        text += os.read(host, 1 << 16)
    sending.join()
    *whole, piece, last, _ = text.split(b"\r")
    assert set(whole) == {b"t2018" + bytes(16).replace(b"\0", b"0")}
    assert last == b"t123101", piece
    os.close(host)
    os.close(terminal)


def test_status_flags_become_error_frames_for_ports_that_want_them(
    start: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    # an adapter that does not answer F at first is not polled again
    monkeypatch.setattr(SlcanAdapter._command, "__defaults__", (60.0, b""))
    adapter = start(GOOD | {b"F": b"F00\r", b"t": b"\a"})
    cyclic, acyclic = open_port(adapter.url), opened(adapter.url, [(0x701, 0x7FF)])
    health = BusHealth()

    def take_error() -> None:
        can_id, _, data = FRAME.unpack(receive(acyclic))
        assert can_id & ERR_FLAG
        health.take_error(can_id, data)

    cyclic.send(frame(0x201))
    take_error()
    assert "transmit overflow" in health.text
    adapter.answers[b"F"] = b"FA4\r"
    take_error()
    assert health.state is BusState.PASSIVE
    adapter.answers[b"F"] = b"F00\r"
    while health.state is not BusState.ACTIVE:
        take_error()
    assert health.errors >= 2
    with pytest.raises(BlockingIOError):
        cyclic.recv_waiting(bytearray(16))
    cyclic.close()
    acyclic.close()


def test_several_ports_share_one_adapter(start: Start) -> None:
    adapter = start(GOOD)
    first, second = opened(adapter.url, [(0x180, 0x780)]), opened(adapter.url)
    adapter.say(b"t7010\rt1810\r")
    assert receive(first) == frame(0x181)
    assert [receive(second) for _ in range(2)] == [frame(0x701), frame(0x181)]
    first.send(frame(0x701, b"\x05"))  # other ports receive it, as on SocketCAN
    assert receive(second) == frame(0x701, b"\x05")
    assert first.drain() == 0
    with pytest.raises(BusError, match="is already in use with other settings"):
        open_port(BusUrl.parse(f"slcan:{adapter.path}?bitrate=500000"))
    first.close()
    first.close()
    adapter.say(b"t1820\r")
    assert receive(second) == frame(0x182)
    with pytest.raises(OSError, match="closed"):
        first.send(frame(0x80))
    second.close()
    assert not [t for t in threading.enumerate() if t.name.startswith("reads slcan")]


def test_an_unplugged_adapter_is_reported_to_all_ports_and_its_name_is_free(start: Start) -> None:
    adapter = start(GOOD)
    ports = opened(adapter.url), opened(adapter.url)
    adapter.pull_out()
    told = f"{adapter.url}: the bus is lost (the serial adapter was unplugged"
    for port in ports:
        assert port.recv_into(bytearray(16)) == 0
        assert told in str(port.lost())
        with pytest.raises(OSError, match="unplugged") as caught:
            port.send(frame(0x80))
        assert told in str(port.lost(caught.value))
    # nothing keeps the name in use, so that the next adapter can get it
    assert not [name for name in open_files() if name.startswith(adapter.path)]
    for port in ports:
        port.close()


def test_a_serial_port_in_use_by_another_program_is_reported(start: Start) -> None:
    adapter = start(GOOD)
    with open(adapter.path, "rb", buffering=0) as other:  # noqa: PTH123  # a terminal
        fcntl.flock(other, fcntl.LOCK_EX | fcntl.LOCK_NB)
        with pytest.raises(BusError, match="is in use by another program"):
            open_port(adapter.url)


# -- socketcand


def test_a_lost_server_can_be_reopened_before_the_old_port_is_closed() -> None:
    server = Server(*GREETING)
    old = opened(server.url)
    server.client.close()
    assert old.recv_into(bytearray(16)) == 0
    assert "the bus is lost (lost the socketcand server: " in str(old.lost())
    with pytest.raises(OSError, match="lost the socketcand server"):
        old.send(frame(0x80))
    server.serve()
    new = opened(server.url)
    old.close()
    server.client.sendall(b"< frame 181 1.0 AA >")
    assert receive(new) == frame(0x181, b"\xaa")
    new.close()
    server.close()


def test_messages_of_a_server_may_be_split_or_joined() -> None:
    server = Server(b"< hi >", b"< ok >", b"< ok >< frame 181 1.5 1122 >< fr")
    port = opened(server.url)
    assert receive(port) == frame(0x181, b"\x11\x22")
    for piece in (
        b"ame 080 23.424",
        b"242  >< frame 12345678 1.0 01 02 03 >",
        b"< frame 7FF 1.0 >< error 20000040 1.0 >",
    ):
        server.client.sendall(piece)
        time.sleep(0.02)
    got = [receive(port) for _ in range(4)]
    assert got == [
        frame(0x080),
        frame(EFF_FLAG | 0x12345678, b"\x01\x02\x03"),
        frame(0x7FF),
        FRAME.pack(ERR_FLAG | 0x040, 8, b""),  # bus-off
    ]
    port.send(frame(0x080))
    port.send(frame(EFF_FLAG | 0x123, b"\x0f\xf4"))
    assert server.heard == b"< open can0 >< rawmode >"
    wanted = b"< send 080 0  >< send 00000123 2 0f f4 >"
    heard = b""
    while len(heard) < len(wanted):
        heard += server.client.recv(4096)
    assert heard == wanted
    with pytest.raises(OSError, match="cannot send remote frames"):
        port.send(FRAME.pack(RTR_FLAG | 0x701, 1, b""))
    port.close()
    server.close()


def test_garbage_from_a_server_loses_no_valid_frame() -> None:
    server = Server(*GREETING)
    port = opened(server.url)
    server.client.sendall(
        b"< frame XYZ 1.0 11 >< frame 181 1.0 123 ><><   ><frame 182><< hello >"
        b"< frame 183 1.0 112233445566778899 >" + b"\xff" * 9000 + b">< frame 184 1.0 AA >"
    )
    got = [receive(port)]
    while got[-1] != frame(0x184, b"\xaa"):
        got.append(receive(port))
    assert got[:-1] in ([], [frame(0x182)])
    port.close()
    server.close()


def test_sending_to_a_server_that_reads_nothing_fails_in_bounded_time() -> None:
    server = Server(*GREETING)
    port = open_port(server.url, [])
    longest = 0.0
    with pytest.raises(OSError, match="accepts no frames"):
        while True:
            started = time.monotonic()
            port.send(frame(0x181, bytes(8)))
            longest = max(longest, time.monotonic() - started)
    assert longest < 60.0
    port.close()
    server.close()


def test_keepalive_detects_a_vanished_server_within_5_s() -> None:
    """Check the socket options for an unplugged network cable."""
    server = Server(*GREETING)
    line = SocketcandAdapter(server.url)
    options = [
        line.sock.getsockopt(socket.IPPROTO_TCP, option)
        for option in (socket.TCP_KEEPIDLE, socket.TCP_KEEPINTVL, socket.TCP_KEEPCNT)
    ]
    assert line.sock.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE)
    assert options[0] + options[1] * options[2] <= 5
    line.close()
    server.close()


@pytest.mark.parametrize(
    ("greeting", "message"),
    [
        (
            (b"< hi >", b"< error could not open bus >"),
            "could not open bus.*does it have a bus 'can0'",
        ),
        ((b"SSH-2.0-OpenSSH", b""), "is lost"),
        ((b"< hello >",), "'hello' to 'the connection'"),
    ],
)
def test_a_server_that_does_not_open_the_bus_is_reported(
    greeting: tuple[bytes, ...], message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("cdpr_drivers.bus.socketcand._ANSWER_S", 0.3)
    server = Server(*greeting)
    with pytest.raises(BusError, match=message):
        open_port(server.url)
    server.close()


# -- any bus


@pytest.mark.parametrize(
    ("url", "message"),
    [
        ("slcan:/dev/ttyNOTHING?bitrate=1000000", "there is no serial port /dev/ttyNOTHING"),
        ("slcan:/dev/null?bitrate=1000000", "/dev/null is not a serial port"),
        ("slcan:/tmp?bitrate=1000000", "/tmp is not a serial port"),
        ("slcan:/dev/ptmx?bitrate=123456", "bitrate 123456; allowed: 10000, "),
        ("slcan:/dev/ptmx?bitrte=1000000", "unknown option 'bitrte'; allowed: bitrate, "),
        ("slcan:/dev/ptmx?tty_baudrate=fast", "tty_baudrate 'fast': this port cannot be set"),
        ("socketcand://127.0.0.1:1/can0", r"no socketcand server at 127\.0\.0\.1:1 \(Connection"),
        ("socketcand://127.0.0.1:1/can0?speed=1", "unknown option 'speed'"),
        ("simbus:nobody-is-home", "no simulated bus of that name is running"),
        ("udp_multicast:no-address", "cannot be opened"),
    ],
)
def test_the_error_for_a_bus_that_cannot_be_opened_names_it_once(url: str, message: str) -> None:
    with pytest.raises(BusError, match=message) as caught:
        open_port(BusUrl.parse(url))
    assert str(caught.value).count(url.split("?", maxsplit=1)[0]) == 1


def test_two_ports_on_a_python_can_interface_share_one_bus() -> None:
    url = BusUrl.parse("virtual:shared-adapters")
    one, two = open_port(url), open_port(url, [(0x181, 0x7FF)])
    with can.Bus("shared-adapters", interface="virtual") as third_party:
        two.settimeout(60.0)
        one.send(frame(0x181, b"ours"))
        third_party.send(can.Message(arbitration_id=0x181, data=b"theirs", is_extended_id=False))
        assert [receive(two), receive(two)] == [frame(0x181, b"ours"), frame(0x181, b"theirs")]
        message = third_party.recv(60.0)
        assert message is not None
        assert bytes(message.data) == b"ours"
    one.close()
    two.close()


def test_frames_lost_by_a_slow_reader_are_counted() -> None:
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
