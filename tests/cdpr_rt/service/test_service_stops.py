"""Stops during floods and planning, over real sockets."""

from __future__ import annotations

import asyncio
import threading
import time
from collections import Counter
from pathlib import Path
from typing import Any

import httpx
import pytest
from waiting import until

from tests.cdpr_rt.service.service_rig import KEY, Rig

RIGHT = {"Authorization": f"Bearer {KEY.decode()}"}


def test_every_stop_of_a_flood_is_accepted(rig: Rig) -> None:
    """Two clients send holds as fast as they can while others disable."""
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


@pytest.mark.parametrize("path", ["/enable", "/program", "/set", "/procedure"])
def test_a_request_older_than_a_stop_by_what_its_client_has_seen_is_rejected(
    rig: Rig, path: str
) -> None:
    body: dict[str, Any] = {"/program": {"program": "jog"}, "/set": {"wanted": {}}}.get(path, {})
    if path == "/procedure":
        body = {"procedure": "commission", "axes": ["left"], "detached": True}
    with httpx.Client(base_url=rig.guarded_url, headers=RIGHT) as client:
        token = client.post("/control", json={"client": "maria", "ttl_s": 10.0}).json()["token"]
        seen = client.get("/status").json()["stop_count"]
        assert client.post("/hold").status_code == 200
        headers = {"X-Control-Token": token, "X-Stops-Seen": str(seen)}
        answer = client.post(path, json={**body, "client": "maria"}, headers=headers)
        assert answer.status_code == 409
        assert "cancelled by a later stop" in answer.json()["error"]
    assert rig.loop.status["state"] == "ready"


def test_a_stop_taken_by_the_loop_is_one_event_and_cancels_planning(rig: Rig) -> None:
    planned = threading.Event()

    async def plan(_file: Path, _request: dict[str, Any]) -> tuple[int, str]:
        await asyncio.to_thread(planned.wait, 60.0)
        return 0, "{}"

    def noted() -> list[tuple[str, int]]:
        return [
            (one["kind"], one["times"])
            for one in rig.service.events.since()
            if one["text"] == "hold by maria@lab"
        ]

    rig.service.planner.work = plan
    with rig.client() as client:
        assert client.post("/path", json={"name": "a.nc", "text": ""}).status_code == 200
        for taken in (1, 2):
            rig.loop.publish(stops={"taken": taken, "do": "hold", "client": "maria@lab"})
            until(lambda taken=taken: noted() == [("command", taken)])  # type: ignore[misc]
        planned.set()
        until(lambda: not client.get("/path").json()["planning"])
        assert "hold by maria@lab" in client.get("/path").json()["error"]
