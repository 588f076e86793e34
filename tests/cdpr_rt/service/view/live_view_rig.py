"""A live view on a port of its own, and a client that knows Foxglove's protocol alone."""

import asyncio
import json
import struct
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from websockets.asyncio.client import connect

from cdpr_rt.core.cycle_row import Row
from cdpr_rt.core.shared_block import RowWriter, SharedBlock
from cdpr_rt.service.listening import listen_tcp
from cdpr_rt.service.view.foxglove_view import LiveView
from tests.cdpr_rt.service.recordings.recording_rig import put

PROTOCOL = "foxglove.sdk.v1"
LONGEST_S = 60.0


@contextmanager
def running(block: SharedBlock) -> Iterator[LiveView]:
    view = LiveView(block, "bench", listen_tcp("127.0.0.1", 0))
    view.start()
    try:
        yield view
    finally:
        view.stop()


@contextmanager
def repeating(block: SharedBlock, row: Row) -> Iterator[None]:
    """Write one row over and over, as a loop at 1 kHz would."""
    end = threading.Event()
    writer = RowWriter(block)

    def write() -> None:
        while not end.wait(0.005):
            for _ in range(5):
                put(writer, row)

    thread = threading.Thread(target=write)
    thread.start()
    try:
        yield
    finally:
        end.set()
        thread.join()


Messages = dict[str, list[tuple[int, bytes]]]


def seen(*topics: str, times: int = 1) -> Callable[[Messages], bool]:
    return lambda messages: all(len(messages.get(topic, ())) >= times for topic in topics)


async def watch(
    url: str, done: Callable[[Messages], bool]
) -> tuple[dict[str, dict[str, Any]], Messages]:
    """Subscribe to all topics; return the channels and the messages of each, with log times."""
    channels: dict[int, dict[str, Any]] = {}
    messages: Messages = {}
    async with connect(url, subprotocols=[PROTOCOL]) as socket:  # type: ignore[list-item]
        while not done(messages):
            text = await asyncio.wait_for(socket.recv(), LONGEST_S)
            if isinstance(text, bytes):
                subscription, log_time = struct.unpack_from("<IQ", text, 1)
                topic = channels[subscription]["topic"]
                messages.setdefault(topic, []).append((log_time, text[13:]))
            elif (said := json.loads(text))["op"] == "advertise":
                new = {channel["id"]: channel for channel in said["channels"]}
                names = {channel["topic"] for channel in channels.values()}
                assert not names & {channel["topic"] for channel in new.values()}
                channels |= new
                wanted = [{"id": number, "channelId": number} for number in new]
                await socket.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))
            elif said["op"] == "unadvertise":
                for number in said["channelIds"]:
                    del channels[number]
    return {channel["topic"]: channel for channel in channels.values()}, messages
