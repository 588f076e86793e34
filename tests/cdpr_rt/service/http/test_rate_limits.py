"""Requests that are too many: slowed down, but what stops."""

from __future__ import annotations

import asyncio
import http.client
from collections.abc import Callable, Coroutine
from types import SimpleNamespace
from typing import Any

import httpx
import pytest

from cdpr_rt.service.http import access_control
from cdpr_rt.service.http.access_control import AccessControl, AccessPolicy
from cdpr_rt.service.http.tickets import Tickets
from tests.cdpr_rt.service.http.service_rig import KEY, Rig

RIGHT = {"Authorization": f"Bearer {KEY.decode()}"}


def test_requests_without_end_are_slowed_down_and_a_stop_still_comes_through(rig: Rig) -> None:
    connection = http.client.HTTPConnection("127.0.0.1", rig.port, timeout=10.0)
    answers = set()
    while 429 not in answers:
        connection.request("GET", "/control")
        answer = connection.getresponse()
        answer.read()
        answers.add(answer.status)
        if answer.getheader("connection") == "close":
            connection.close()
    assert httpx.post(f"{rig.url}/hold").status_code == 200
    with rig.client() as client:  # others have their own measure
        assert client.get("/control").status_code == 200


def test_a_flood_does_not_shut_out_the_one_that_may_move_from_the_same_address(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(access_control, "time", SimpleNamespace(monotonic=lambda: 0.0))
    ask = _asking("the token".__eq__)

    async def flood() -> list[int]:
        while await ask() != 429:
            pass
        return [await ask(x_control_token=token) for token in ("another", "the token")]

    assert asyncio.run(flood()) == [429, 200]


@pytest.mark.parametrize("path", sorted(access_control.URGENT_PATHS))
def test_only_what_stops_is_free_from_the_measure_of_requests(
    path: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(access_control, "time", SimpleNamespace(monotonic=lambda: 0.0))
    ask = _asking(lambda _token: False)

    async def flood() -> list[int]:
        for _ in range(1000):
            if await ask("GET", path) == 429:
                break
        others = [await ask(method, path) for method in ("GET", "HEAD", "PUT", "OPTIONS")]
        return [*others, await ask("POST", path)]

    assert asyncio.run(flood()) == [429, 429, 429, 429, 200]


def _asking(holds_right: Callable[[str], bool]) -> Callable[..., Coroutine[Any, Any, int]]:
    """Return what asks by way of the Unix socket's policy and returns the status of the answer."""

    async def app(scope: Any, receive: Any, send: Any) -> None:
        await send({"type": "http.response.start", "status": 200, "headers": []})
        await send({"type": "http.response.body", "body": b""})

    async def receive() -> dict[str, Any]:
        return {"type": "http.request"}

    access = AccessControl(app, AccessPolicy(local=True), lambda: None, holds_right, Tickets())

    async def ask(method: str = "GET", path: str = "/control", **headers: str) -> int:
        sent: list[dict[str, Any]] = []

        async def send(message: Any) -> None:
            sent.append(message)

        given = [(name.replace("_", "-").encode(), text.encode()) for name, text in headers.items()]
        scope = {"type": "http", "method": method, "path": path, "headers": given, "state": {}}
        await access({**scope, "client": ("10.0.0.1", 1)}, receive, send)
        return int(sent[0]["status"])

    return ask
