"""Stops come before all else, but not those of strangers without end: over real sockets."""

from __future__ import annotations

import asyncio
import socket
import threading
import time
from collections import Counter
from collections.abc import Callable
from contextlib import ExitStack
from types import SimpleNamespace
from typing import Any

import httpx
import pytest
from service_rig import KEY, Rig

from cdpr_rt.service import connections, reception, server
from cdpr_rt.service.auth import Door, Gate
from cdpr_rt.service.listening import listen_tcp

RIGHT = {"Authorization": f"Bearer {KEY.decode()}"}


def test_no_stop_is_one_too_many(rig: Rig) -> None:
    """One client asks for a hold as fast as it can; another disables all the while."""
    ended = threading.Event()
    seen: Counter[int] = Counter()

    def flood(client: httpx.Client) -> None:
        with client:
            while not ended.is_set():
                seen[client.post("/hold", json={"client": "flood"}).status_code] += 1

    clients = [rig.client(), httpx.Client(base_url=rig.url)]
    threads = [threading.Thread(target=flood, args=(client,)) for client in clients]
    for thread in threads:
        thread.start()
    try:
        begin = time.monotonic()
        while sum(seen.values()) < 300 or time.monotonic() - begin < 1.0:
            with rig.client() as near:
                assert near.post("/disable").status_code == 200
            assert httpx.post(f"{rig.url}/disable").status_code == 200
            assert time.monotonic() - begin < 60.0
    finally:
        ended.set()
        for thread in threads:
            thread.join()
    assert set(seen) == {200}


class NoTurns(connections.Turns):
    """Where nobody has a turn; it keeps what asks for one."""

    def __init__(self) -> None:
        super().__init__()
        self.asked: list[Any] = []

    def ask(self, work: Any, known: bool = False) -> None:
        self.asked.append(work)


@pytest.mark.parametrize(("for_all", "at_once"), [(False, [True]), (True, [False, True])])
def test_a_stop_that_will_be_refused_goes_before_nobody(for_all: bool, at_once: list[bool]) -> None:
    entered: list[bool] = []
    turns = NoTurns()

    def enter(is_known: bool, is_first: bool) -> asyncio.Protocol:
        assert is_first
        entered.append(is_known)
        return asyncio.Protocol()

    async def receive() -> None:
        listener = listen_tcp("127.0.0.1", 0)
        one = reception.Reception(
            listener,
            enter,
            lambda head: KEY in head,
            lambda is_known: is_known or for_all,
            turns,
            lambda _: None,
        )
        for head in (b"\r\n\r\n", b"Authorization: Bearer " + KEY + b"\r\n\r\n"):
            sock = stack.enter_context(socket.create_connection(listener.getsockname()))
            sock.sendall(b"POST /hold HTTP/1.1\r\n" + head)
            await asyncio.sleep(0.1)
        one.close()
        listener.close()

    with ExitStack() as stack:
        asyncio.run(receive())
    assert entered == at_once
    assert len(turns.asked) == 2 - len(at_once)


def test_of_strangers_stops_on_tcp_a_few_a_second_go_before_all_else(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """From however many addresses they come; those of the known and of the socket always do."""
    now_s = 0.0
    monkeypatch.setattr(server, "time", SimpleNamespace(monotonic=lambda: now_s))

    def first(door: Door, is_known: bool) -> Callable[[int], list[bool]]:
        gate = Gate(Any, door, lambda: None, lambda _token: False)  # type: ignore[arg-type]
        with socket.socket() as sock:
            one = server.Server(gate, sock, turns, lambda _: None)
        return lambda count: [one._goes_first(is_known) for _ in range(count)]

    class Stepped(connections.Turns):
        back = 0

        def give_way(self) -> None:
            self.back += 1

    turns = Stepped()
    stranger = first(Door(), is_known=False)
    assert stranger(6) == [True] * 4 + [False] * 2
    now_s = 0.1
    assert stranger(3) == [True, True, False]
    assert turns.back == 0
    assert first(Door(key=KEY), is_known=False)(1) == [False]
    assert first(Door(local=True), is_known=False)(100) == [True] * 100
    assert first(Door(), is_known=True)(100) == [True] * 100
    assert turns.back == 200


def test_a_stranger_whose_stop_is_one_of_many_waits_for_its_turn(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    waited: list[bool] = []
    ask = connections.Turns.ask

    def note(self: connections.Turns, work: Any, known: bool = False) -> None:
        waited.append(known)
        ask(self, work, known)

    monkeypatch.setattr(connections.Turns, "ask", note)
    monkeypatch.setattr(server.TokenBuckets, "take", lambda *_: False)
    assert httpx.post(f"{rig.url}/hold").status_code == 200
    assert waited == [False, False]  # to come in, and to be heard
    assert [command["do"] for command in rig.loop.commands] == ["hold"]
