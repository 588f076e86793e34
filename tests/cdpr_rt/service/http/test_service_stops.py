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

from cdpr_rt.service.http import acceptor, connections, server
from cdpr_rt.service.http.access_control import AccessControl, AccessPolicy
from cdpr_rt.service.http.tickets import Tickets
from cdpr_rt.service.listening import listen_tcp
from tests.cdpr_rt.service.http.service_rig import KEY, Rig

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
    finally:
        ended.set()
        for thread in threads:
            thread.join()
    assert set(seen) == {200}


class StoppedQueue(connections.FairQueue):
    """A queue that runs nothing; it keeps what is submitted."""

    def __init__(self) -> None:
        super().__init__()
        self.submitted: list[Any] = []

    def submit(self, work: Any, authenticated: bool = False) -> None:
        self.submitted.append(work)


@pytest.mark.parametrize(("for_all", "at_once"), [(False, [True]), (True, [False, True])])
def test_a_stop_that_will_be_refused_goes_before_nobody(for_all: bool, at_once: list[bool]) -> None:
    entered: list[bool] = []
    queue = StoppedQueue()

    def enter(is_authenticated: bool, first_has_priority: bool) -> asyncio.Protocol:
        assert first_has_priority
        entered.append(is_authenticated)
        return asyncio.Protocol()

    async def receive() -> None:
        listener = listen_tcp("127.0.0.1", 0)
        one = acceptor.Acceptor(
            listener,
            enter,
            lambda head: KEY in head,
            lambda is_authenticated: is_authenticated or for_all,
            queue,
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
    assert len(queue.submitted) == 2 - len(at_once)


def test_of_strangers_stops_on_tcp_a_few_a_second_go_before_all_else(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """From however many addresses they come; those of the known and of the socket always do."""
    now_s = 0.0
    monkeypatch.setattr(server, "time", SimpleNamespace(monotonic=lambda: now_s))

    def first(policy: AccessPolicy, is_authenticated: bool) -> Callable[[int], list[bool]]:
        access = AccessControl(Any, policy, lambda: None, lambda _token: False, Tickets())  # type: ignore[arg-type]
        with socket.socket() as sock:
            one = server.Server(access, sock, queue, lambda _: None)
        return lambda count: [one._has_priority(is_authenticated) for _ in range(count)]

    class Stepped(connections.FairQueue):
        back = 0

        def yield_to_stop(self) -> None:
            self.back += 1

    queue = Stepped()
    stranger = first(AccessPolicy(), is_authenticated=False)
    assert stranger(6) == [True] * 4 + [False] * 2
    now_s = 0.1
    assert stranger(3) == [True, True, False]
    assert queue.back == 0
    assert first(AccessPolicy(key=KEY), is_authenticated=False)(1) == [False]
    assert first(AccessPolicy(local=True), is_authenticated=False)(100) == [True] * 100
    assert first(AccessPolicy(), is_authenticated=True)(100) == [True] * 100
    assert queue.back == 200


def test_a_stranger_whose_stop_is_one_of_many_waits_for_its_turn(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    waited: list[bool] = []
    submit = connections.FairQueue.submit

    def note(self: connections.FairQueue, work: Any, authenticated: bool = False) -> None:
        waited.append(authenticated)
        submit(self, work, authenticated)

    monkeypatch.setattr(connections.FairQueue, "submit", note)
    monkeypatch.setattr(server.TokenBuckets, "take", lambda *_: False)
    assert httpx.post(f"{rig.url}/hold").status_code == 200
    assert waited == [False, False]  # to come in, and to be heard
    assert [command["do"] for command in rig.loop.commands] == ["hold"]
