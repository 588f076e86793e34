"""Socketcand servers that behave badly."""

from __future__ import annotations

import select
import socket
import threading
import time

import can
import pytest

from cdpr_drivers.bus import BusHealth, BusState, BusUrl, open_port, open_python_can
from cdpr_drivers.bus.adapters.socketcand import SocketcandConnection
from cdpr_drivers.bus.frames import EFF_FLAG, FRAME, RTR_FLAG
from cdpr_drivers.errors import BusError
from tests.drivers.bus.port_frames import frame, receive


class Server:
    """Plays a socketcand server that says what the test wants, in pieces as the test cuts them."""

    def __init__(self, *greeting: bytes) -> None:
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.heard = b""
        self.client: socket.socket
        self._greeting = greeting
        self.serve()

    def serve(self) -> None:
        """Greet one client."""
        self._thread = threading.Thread(target=self._greet, daemon=True)
        self._thread.start()

    @property
    def url(self) -> BusUrl:
        return BusUrl.parse(f"socketcand://127.0.0.1:{self.listener.getsockname()[1]}/can0")

    def _greet(self) -> None:
        self.client, _ = self.listener.accept()
        for text in self._greeting:
            self.client.sendall(text)
            if text != self._greeting[-1]:
                self.heard += self.client.recv(4096)

    def close(self) -> None:
        self.listener.close()
        self._thread.join(60.0)
        self.client.close()


GREETING = (b"< hi >", b"< ok >", b"< ok >")


def test_a_lost_line_can_be_opened_again_while_the_old_port_is_held() -> None:
    server = Server(*GREETING)
    old = open_python_can(server.url)
    server.client.close()
    with pytest.raises(can.CanError, match="lost the socketcand server"):
        old.recv(60.0)
    server.serve()
    new = open_python_can(server.url)
    old.shutdown()
    server.client.sendall(b"< frame 181 1.0 AA >")
    message = new.recv(60.0)
    assert message is not None
    assert bytes(message.data) == b"\xaa"
    new.shutdown()
    server.close()


def test_a_conversation_in_pieces_and_glued_together() -> None:
    server = Server(b"< hi >", b"< ok >", b"< ok >< frame 181 1.5 1122 >< fr")
    port = open_port(server.url)
    port.settimeout(60.0)
    assert receive(port) == frame(0x181, b"\x11\x22")
    for piece in (
        b"ame 080 23.424",
        b"242  >< frame 12345678 1.0 01 02 03 >",
        b"< frame 7FF 1.0 >",
    ):
        server.client.sendall(piece)
        time.sleep(0.02)
    got = [receive(port) for _ in range(3)]
    assert got == [frame(0x080), frame(EFF_FLAG | 0x12345678, b"\x01\x02\x03"), frame(0x7FF)]
    port.send(frame(0x080))
    port.send(frame(EFF_FLAG | 0x123, b"\x0f\xf4"))
    assert server.heard == b"< open can0 >< rawmode >"
    wanted = b"< send 080 0  >< send 00000123 2 0f f4 >"
    heard = b""
    while len(heard) < len(wanted):
        heard += server.client.recv(4096)
    assert heard == wanted
    with pytest.raises(OSError, match="no remote frames"):
        port.send(FRAME.pack(RTR_FLAG | 0x701, 1, b""))
    port.close()
    server.close()


def test_rubbish_from_a_server_loses_no_frame() -> None:
    server = Server(*GREETING)
    port = open_port(server.url)
    port.settimeout(60.0)
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


def test_frames_taken_in_one_piece_can_still_be_polled_for() -> None:
    server = Server(*GREETING)
    port = open_port(server.url, [(0x180, 0x780)])
    port.settimeout(60.0)
    server.client.sendall(b"< frame 181 1.0 01 >< frame 182 1.0 02 >< frame 183 1.0 03 >")
    for can_id in (0x181, 0x182):
        assert receive(port) == frame(can_id, bytes([can_id & 3]))
        assert select.select([port], [], [], 0.0)[0]
    buffer = bytearray(16)
    assert port.recv_waiting(buffer) == 16
    assert buffer == frame(0x183, b"\x03")
    assert not select.select([port], [], [], 0.0)[0]
    with pytest.raises(BlockingIOError):
        port.recv_waiting(buffer)
    server.client.sendall(b"< frame 184 1.0 >")
    assert select.select([port], [], [], 60.0)[0]
    assert receive(port) == frame(0x184)
    port.close()
    server.close()


def test_error_frames_of_a_server() -> None:
    server = Server(*GREETING)
    bus = open_python_can(server.url, [(0x701, 0x7FF)])
    server.client.sendall(b"< error 20000040 1.0 >")
    message = bus.recv(60.0)
    assert message is not None
    health = BusHealth()
    assert health.take_error(message.arbitration_id, bytes(message.data))
    assert health.state is BusState.BUS_OFF
    bus.shutdown()
    server.close()


def test_the_end_of_the_connection_is_reported_soon() -> None:
    server = Server(*GREETING)
    port = open_port(server.url)
    port.settimeout(3600.0)
    server.close()
    with pytest.raises(OSError, match="lost the socketcand server") as caught:
        port.recv_into(bytearray(16))
    assert "the bus has gone away (lost the socketcand server: " in str(port.lost(caught.value))
    with pytest.raises(OSError, match="lost the socketcand server"):
        port.send(frame(0x80))
    port.close()


def test_and_on_the_acyclic_side() -> None:
    server = Server(*GREETING)
    bus = open_python_can(server.url)
    server.close()
    with pytest.raises(can.CanError, match="lost the socketcand server"):
        bus.recv(60.0)
    with pytest.raises(can.CanError, match="lost the socketcand server"):
        bus.send(can.Message(arbitration_id=0x80, is_extended_id=False))
    bus.shutdown()


def test_a_server_that_takes_nothing_is_given_up_in_bounded_time() -> None:
    server = Server(*GREETING)
    port = open_port(server.url, [])
    longest = 0.0
    with pytest.raises(OSError, match="takes no frames"):
        while True:
            started = time.monotonic()
            port.send(frame(0x181, bytes(8)))
            longest = max(longest, time.monotonic() - started)
    assert longest < 60.0
    port.close()
    server.close()


def test_a_ports_filters_and_time_outs_hold_on_a_connection_of_its_own() -> None:
    server = Server(*GREETING)
    port = open_port(server.url, [(0x181, 0x7FF)])
    server.client.sendall(b"< frame 182 1.0 >< error 20000040 1.0 >< frame 181 1.0 55 >" * 3)
    port.settimeout(60.0)
    assert receive(port) == frame(0x181, b"\x55")
    assert port.drain() == 2
    assert port.drain() == 0
    for timeout_s in (0, 0.1):
        port.settimeout(timeout_s)
        started = time.monotonic()
        with pytest.raises(BlockingIOError) as caught:
            port.recv_into(bytearray(16))
        assert timeout_s <= time.monotonic() - started
    assert "time-out" in str(port.lost(caught.value))
    port.close()
    server.close()


def test_a_peer_that_vanishes_without_a_word_is_given_up() -> None:
    """Unplugged network cable: what the kernel is told to do about it."""
    server = Server(*GREETING)
    line = SocketcandConnection(server.url)
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
        ((b"< hi >", b"< error could not open bus >"), "could not open bus.*has it a bus 'can0'"),
        ((b"SSH-2.0-OpenSSH", b""), "went away"),
        ((b"< hello >",), "'hello' to 'the connection'"),
    ],
)
def test_a_server_that_will_not(
    greeting: tuple[bytes, ...], message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("cdpr_drivers.bus.adapters.socketcand._ANSWER_S", 0.3)
    server = Server(*greeting)
    with pytest.raises(BusError, match=message):
        open_port(server.url)
    server.close()
