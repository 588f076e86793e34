"""Run as a program: look at both live views of a daemon until standard input ends.

The argument is the daemon's Unix socket. Tells one line of JSON once both have sent something.
"""

from __future__ import annotations

import asyncio
import json
import sys
from typing import Any

import httpx
from websockets.asyncio.client import ClientConnection, connect, unix_connect
from websockets.typing import Subprotocol

_FASTEST_HZ = 50
_TIMEOUT_S = 30.0
_PROTOCOL = Subprotocol("foxglove.sdk.v1")


async def _foxglove_url(control: str) -> str:
    """Wait until the daemon serves, and return where its Foxglove view is."""
    transport = httpx.AsyncHTTPTransport(uds=control)
    async with httpx.AsyncClient(transport=transport, base_url="http://daemon") as http:
        while True:
            try:
                parts: dict[str, Any] = (await http.get("/status")).json()["parts"]
            except httpx.TransportError:
                await asyncio.sleep(0.05)
            else:
                return str(parts["live_view"]["url"])


async def _follow(view: ClientConnection) -> bool:
    """Take a message, ask for every channel it offers; return whether it was figures."""
    message = await view.recv()
    if isinstance(message, bytes):
        return True
    offered = json.loads(message).get("channels", [])
    subscriptions = [{"id": channel["id"], "channelId": channel["id"]} for channel in offered]
    if subscriptions:
        await view.send(json.dumps({"op": "subscribe", "subscriptions": subscriptions}))
    return False


async def _take(figures: ClientConnection) -> None:
    async for _ in figures:
        pass


async def _take_view(view: ClientConnection) -> None:
    while True:
        await _follow(view)


async def _look(control: str) -> None:
    async with asyncio.timeout(_TIMEOUT_S):
        url = await _foxglove_url(control)
    live = unix_connect(control, f"ws://daemon/live?rate_Hz={_FASTEST_HZ}")
    async with live as figures, connect(url, subprotocols=[_PROTOCOL]) as view:
        async with asyncio.timeout(_TIMEOUT_S):
            await figures.recv()
            while not await _follow(view):
                pass
        print(json.dumps({"watching": True}), flush=True)
        takers = [asyncio.create_task(_take(figures)), asyncio.create_task(_take_view(view))]
        await asyncio.to_thread(sys.stdin.read)
        for taker in takers:
            taker.cancel()


if __name__ == "__main__":
    asyncio.run(_look(sys.argv[1]))
