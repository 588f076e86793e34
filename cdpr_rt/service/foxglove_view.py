"""Live view: data of a running robot for Foxglove, over WebSocket on this machine only."""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import math
import re
import socket
import struct
import time
from base64 import b64encode
from collections.abc import AsyncIterator, Callable, Collection, Sequence
from dataclasses import dataclass
from functools import partial
from http import HTTPStatus
from typing import Any, Final

import numpy as np
from foxglove import Schema
from foxglove.messages import (
    Color,
    FrameTransform,
    LinePrimitive,
    LinePrimitiveLineType,
    Log,
    LogLevel,
    Point3,
    Pose,
    PoseInFrame,
    Quaternion,
    SceneEntity,
    SceneUpdate,
    Timestamp,
    Vector3,
)
from scipy.spatial.transform import Rotation
from websockets.asyncio.server import ServerConnection, broadcast, serve
from websockets.http11 import Request, Response
from websockets.typing import Subprotocol

from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.cycle_row import AXIS_FIELDS, SCALAR_FIELDS, Row
from cdpr_rt.core.shared_block import RowReader, SharedBlock
from cdpr_rt.service.access_control import TokenBuckets, is_own_host
from cdpr_rt.service.part import Part
from cdpr_rt.service.recording import EventDetector
from cdpr_rt.service.rows import LABELS, PublishedText, WallClock

# Foxglove's WebSocket protocol, served to allowed viewers, with bounded cost.

MOST_VIEWERS: Final = 16
PROTOCOL: Final = Subprotocol("foxglove.sdk.v1")
_OPEN_S, _TIMEOUT_S = 5.0, 10.0
_UNREAD_BYTES: Final = 1 << 16
_MOST_UNSENT_BYTES: Final = 1 << 18
_MOST_RECEIVED_BYTES: Final = 1 << 16
"""Rate limit of a viewer's messages: in one burst, and per second."""
_MOST_REASON: Final = 200
_MOST_ID: Final = (1 << 32) - 1
_DATA: Final = struct.Struct("<BIQ")
_MESSAGE_DATA: Final = 1  # the opcode of binary frames that carry a message


@dataclass(frozen=True)
class Topic:
    """A topic that viewers can subscribe to; the `encoding` of its messages is `json` or
    `protobuf`.
    """

    number: int
    name: str
    encoding: str
    schema: Schema

    def advertisement(self) -> dict[str, Any]:
        """Return the advertisement of the topic."""
        data = self.schema.data
        is_text = self.encoding == "json"
        return {
            "id": self.number,
            "topic": self.name,
            "encoding": self.encoding,
            "schemaName": self.schema.name,
            "schemaEncoding": self.schema.encoding,
            "schema": data.decode() if is_text else b64encode(data).decode(),
        }


class FoxgloveServer:
    """Admits viewers, advertises the topics, and sends each viewer the topics of its subscriptions.

    All methods except `status` belong to the asyncio loop that serves. `name` is the name of the
    server. `origins` are the web pages that may connect, as a browser writes them; programs send no
    `Origin`. The server never waits for a viewer that does not read: the viewer misses messages and
    is disconnected.
    """

    def __init__(self, name: str, origins: Collection[str]) -> None:
        self._name = name
        self._origins = {origin.lower().rstrip("/") for origin in origins}
        self._topics: dict[int, Topic] = {}
        self._numbers = 0
        self._session = str(time.time_ns())
        self._handshaking: dict[_Viewer, None] = {}
        self._viewers: set[_Viewer] = set()
        self._is_ending = False
        self._refused = 0
        self._refused_last = ""
        # the library logs lines for each client that sends invalid data, which could fill a disk
        self._logger = logging.getLogger(f"{__name__}.silent")
        self._logger.disabled = True

    @contextlib.asynccontextmanager
    async def serving(self, listener: socket.socket) -> AsyncIterator[None]:
        """Admit viewers at `listener`, and close all connections at the end."""
        async with serve(
            self._serve_viewer,
            sock=listener,
            backlog=2 * MOST_VIEWERS,
            create_connection=partial(_Viewer, self),  # type: ignore[arg-type]  # a class is callable
            subprotocols=[PROTOCOL],
            process_request=self._check,
            process_response=self._on_response,
            compression=None,  # compression would need 300 kB per viewer
            server_header=None,
            open_timeout=_OPEN_S,
            close_timeout=1.0,
            max_size=_MOST_RECEIVED_BYTES,
            max_queue=4,
            logger=self._logger,
        ):
            try:
                yield
            finally:
                self._is_ending = True
                for one in (*self._handshaking, *self._viewers):
                    one.transport.abort()

    def advertise(self, name: str, encoding: str, schema: Schema) -> Topic:
        """Offer a topic to all viewers."""
        self._numbers += 1
        topic = self._topics[self._numbers] = Topic(self._numbers, name, encoding, schema)
        self._send_json_to_all({"op": "advertise", "channels": [topic.advertisement()]})
        return topic

    def withdraw(self) -> None:
        """Withdraw all topics."""
        self._send_json_to_all({"op": "unadvertise", "channelIds": list(self._topics)})
        self._topics.clear()
        for viewer in self._viewers:
            viewer.subscriptions.clear()

    def is_wanted(self, topic: Topic) -> bool:
        """Whether a viewer has subscribed to the topic."""
        return any(topic.number in viewer.subscriptions for viewer in self._viewers)

    def send(self, topic: Topic, data: bytes, time_ns: int) -> None:
        """Send a message with the time `time_ns` since 1970 to subscribers that have read all
        others.
        """
        for viewer in self._viewers:
            number = viewer.subscriptions.get(topic.number)
            if number is not None and viewer.has_room():
                broadcast([viewer], _DATA.pack(_MESSAGE_DATA, number, time_ns) + data)

    def status(self) -> dict[str, Any]:
        """Return how many viewers are connected, how many were refused, and the last reason."""
        return {
            "viewers": len(self._viewers),
            "refused": self._refused,
            "refused_last": self._refused_last,
        }

    def admit(self, viewer: _Viewer) -> None:
        """Accept a new connection; if too many are open, disconnect the oldest silent one."""
        if self._is_ending:  # shutting down would wait for this viewer
            viewer.transport.abort()
        if len(self._handshaking) >= MOST_VIEWERS:
            oldest = next(iter(self._handshaking))
            del self._handshaking[oldest]
            oldest.transport.abort()
        self._handshaking[viewer] = None

    def remove(self, viewer: _Viewer) -> None:
        """Remove a lost connection."""
        self._handshaking.pop(viewer, None)
        self._viewers.discard(viewer)

    def _check(self, viewer: ServerConnection, request: Request) -> Response | None:
        """Return the answer to a viewer that may not connect, None to admit it."""
        status = HTTPStatus.FORBIDDEN
        hosts, origins = request.headers.get_all("Host"), request.headers.get_all("Origin")
        strange = [origin for origin in origins if origin.lower() not in self._origins]
        if strange:
            reason = f"Origin: {strange[0] or 'null'} is not allowed; see --live-origin"
        elif len(hosts) != 1 or not is_own_host(
            hosts[0], ()
        ):  # on loopback no program needs a host name
            given = ", ".join(hosts)
            reason = f"Host: {given}: allowed: localhost, or a numeric address"
        elif len(self._viewers) >= MOST_VIEWERS:
            status = HTTPStatus.SERVICE_UNAVAILABLE
            reason = f"{MOST_VIEWERS} others are already watching"
        else:
            return None
        return viewer.respond(status, f"{self._note(reason)}\n")

    def _on_response(self, viewer: ServerConnection, _: Request, response: Response) -> None:
        if response.status_code == HTTPStatus.SWITCHING_PROTOCOLS:
            assert isinstance(viewer, _Viewer)  # the server creates only these
            self._handshaking.pop(viewer, None)
            self._viewers.add(viewer)
        elif error := viewer.protocol.handshake_exc:
            self._note(str(error))

    def _note(self, reason: str) -> str:
        self._refused += 1
        # older versions of the library leave lone surrogates, which an answer cannot contain
        printable = reason.encode("utf-8", "backslashreplace").decode()
        self._refused_last = printable[:_MOST_REASON]
        return self._refused_last

    async def _serve_viewer(self, viewer: ServerConnection) -> None:
        assert isinstance(viewer, _Viewer)  # the server creates only these
        about = {"name": self._name, "capabilities": [], "metadata": {}}
        viewer.send_json({"op": "serverInfo", **about, "sessionId": self._session})
        topics = [topic.advertisement() for topic in self._topics.values()]
        viewer.send_json({"op": "advertise", "channels": topics})
        viewer.is_greeted = True
        async for message in viewer:
            if isinstance(message, str):
                self._handle_message(viewer, message)

    def _handle_message(self, viewer: _Viewer, message: str) -> None:
        """Subscribe or unsubscribe; all other messages are ignored."""
        try:
            asked = json.loads(message)
        except (ValueError, RecursionError):
            return
        match asked:
            case {"op": "subscribe", "subscriptions": list(wishes)}:
                for wish in wishes:
                    match wish:
                        case {"id": int(number), "channelId": int(topic)}:
                            if topic in self._topics and 0 <= number <= _MOST_ID:
                                viewer.subscriptions[topic] = number
            case {"op": "unsubscribe", "subscriptionIds": list(given)}:
                ended = {number for number in given if isinstance(number, int)}
                kept = {topic: n for topic, n in viewer.subscriptions.items() if n not in ended}
                viewer.subscriptions = kept

    def _send_json_to_all(self, what: dict[str, Any]) -> None:
        for viewer in self._viewers:
            if viewer.is_greeted:
                viewer.send_json(what)


class _Viewer(ServerConnection):
    """A connection; it is closed if the viewer sends too much or reads too slowly."""

    def __init__(self, server: FoxgloveServer, *given: Any, **named: Any) -> None:
        super().__init__(*given, **named)
        self.subscriptions: dict[int, int] = {}
        """Number of the subscription to each topic, by number of the topic."""
        self.is_greeted = False
        self._foxglove = server
        self._received = TokenBuckets(_MOST_RECEIVED_BYTES, _MOST_RECEIVED_BYTES)
        self._kept_up_s = self.loop.time()

    def send_json(self, what: dict[str, Any]) -> None:
        """Send a message of the protocol, without waiting."""
        broadcast([self], json.dumps(what))

    def has_room(self) -> bool:
        """Whether there is room for a message; ends the connection if there was no room for too
        long.
        """
        now_s = self.loop.time()
        if self.transport.get_write_buffer_size() <= _MOST_UNSENT_BYTES:
            self._kept_up_s = now_s
            return True
        if now_s - self._kept_up_s > _TIMEOUT_S:
            self.transport.abort()
        return False

    def connection_made(self, transport: Any) -> None:
        super().connection_made(transport)
        self._foxglove.admit(self)
        # keep a backlog of only some kilobytes; more would be outdated when the viewer reads it
        transport.get_extra_info("socket").setsockopt(
            socket.SOL_SOCKET, socket.SO_SNDBUF, _UNREAD_BYTES
        )

    def connection_lost(self, exc: Exception | None) -> None:
        self._foxglove.remove(self)
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        if not self._received.take("", self.loop.time(), len(data)):
            self.transport.abort()
            return
        super().data_received(data)
        # otherwise answers to pings are queued without limit
        if self.transport.get_write_buffer_size() > 2 * _MOST_UNSENT_BYTES:
            self.transport.abort()


# A robot's cables and platform in Foxglove's 3D panel.

_LOOSE, _PLATFORM = Color(r=0.6, g=0.6, b=0.6, a=1.0), Color(r=0.82, g=0.35, b=0.1, a=1.0)
_PIXELS = 3.0
_LOW_N, _HIGH_N = 0.0, 100.0


class CableScene:
    """The lines of one robot's cables, from exit to anchor points, and of its platform's edges.

    A cable is coloured by its tension: blue at the lower bound, through green, to red at the upper
    one; grey if it is loose or unknown.
    """

    def __init__(self, description: dict[str, Any]) -> None:
        """Raise KeyError, TypeError or ValueError if the description has no platform."""
        platform, limits = description["platform"], description.get("limits", {})
        self._exits = _in_space(platform["exit_points_m"])
        self._anchors = _in_space(platform["anchor_points_m"])
        n = len(self._exits)
        self._low = _bounds(limits.get("tension_min_N"), n, _LOW_N)
        self._high = _bounds(limits.get("tension_max_N"), n, _HIGH_N)
        self._slack = _bounds(limits.get("slack_N"), n, 0.0)

    def update(self, pose: FloatArray, tension_N: FloatArray, stamp: Timestamp) -> SceneUpdate:
        """Return the scene with the platform at `pose` (7,) and these tensions (n,)."""
        anchors = pose[:3] + Rotation.from_quat(np.roll(pose[3:], -1)).apply(self._anchors)
        cables = [
            _line([a, b], self._colour(k, float(tension_N[k])))
            for k, (a, b) in enumerate(zip(self._exits, anchors, strict=True))
        ]
        edges = [
            _line([anchors[i], anchors[j]], _PLATFORM)
            for i in range(len(anchors))
            for j in range(i)
        ]
        entity = SceneEntity(timestamp=stamp, frame_id="base", id="robot", lines=[*cables, *edges])
        return SceneUpdate(entities=[entity])

    def _colour(self, cable: int, tension_N: float) -> Color:
        if not tension_N > self._slack[cable]:
            return _LOOSE
        low, high = self._low[cable], self._high[cable]
        # with equal limits, tensions below and above still get different colours
        share = (
            float(np.interp(tension_N, (low, high), (0.0, 1.0)))
            if low < high
            else (float(tension_N > high))
        )
        green = 1.0 - abs(2.0 * share - 1.0)
        return Color(r=max(2.0 * share - 1.0, 0.0), g=green, b=max(1.0 - 2.0 * share, 0.0), a=1.0)


def _in_space(points: Sequence[Sequence[float]]) -> FloatArray:
    """Return points (n, 3); those of a planar robot lie at z = 0."""
    flat = np.array(points, float)
    return np.pad(flat, ((0, 0), (0, 3 - flat.shape[1])))


def _bounds(values: Sequence[float | None] | None, n: int, otherwise: float) -> list[float]:
    given = list(values or [None] * n)
    return [otherwise if value is None else float(value) for value in given]


def _line(points: Sequence[FloatArray], color: Color) -> LinePrimitive:
    return LinePrimitive(
        type=LinePrimitiveLineType.LineStrip,
        thickness=_PIXELS,
        scale_invariant=True,
        points=[Point3(x=float(x), y=float(y), z=float(z)) for x, y, z in points],
        color=color,
    )


RATE_Hz: Final = 50.0
_AXES: Final = {
    field.name: re.sub(r"_rad(?=_s$|$)", "_deg", field.name) for field in AXIS_FIELDS if field.live
}
"""Name of each field of an axis in the live view."""
_SCALARS: Final = tuple(field for field in SCALAR_FIELDS if field.live)
_TIMES: Final = {
    field.name: re.sub(r"_s$", "_ms", field.name) for field in _SCALARS if field.is_wall_time
}
_NUMBERS: Final = tuple(field.name for field in _SCALARS if field.kind == "<f8" and not field.wall)
_COUNTS: Final = tuple(field.name for field in _SCALARS if field.kind != "<f8")


class LiveView(Part):
    """Shows the newest row of a block `RATE_Hz` times a second to clients of `listener`.

    Only subscribed topics are computed. Clients cannot change anything. `origins` are the web pages
    that may also connect.
    """

    name = "live_view"

    def __init__(
        self,
        block: SharedBlock,
        robot: str,
        listener: socket.socket,
        origins: Collection[str] = (),
        ended: Callable[[str], None] | None = None,
    ) -> None:
        super().__init__("live view", ended)
        self._block = block
        self._listener = listener
        self._wall = WallClock(block)
        self._reader = RowReader(block)
        self._events = EventDetector()
        self._description = PublishedText(block, "description")
        self._status = PublishedText(block, "status")
        self._topics: _Topics | None = None
        self._server = FoxgloveServer(f"cdpr-rt {robot}", origins)
        self._url = "ws://{}:{}".format(*listener.getsockname())
        self._messages = 0

    def status(self) -> dict[str, Any]:
        """Return the URL to connect to, the number of rows shown, and the error.

        Also returns the numbers of connected and rejected viewers, and the reason of the last
        rejection.
        """
        figures = {"url": self._url, "moments": self._messages, "error": self._error}
        return {**figures, **self._server.status()}

    def _serve(self) -> None:
        asyncio.run(self._serve_viewers())

    async def _serve_viewers(self) -> None:
        async with self._server.serving(self._listener):
            while not self._end.is_set():
                self._show()
                await asyncio.sleep(1.0 / RATE_Hz)

    def _show(self) -> None:
        if self._description.update():
            self._describe(self._description.value)
        rows = self._reader.read()
        if self._topics is None:
            return  # the names of the axes are not known yet
        events = [(event["text"], stamp) for event, stamp in self._events.of_rows(rows)]
        for event in self._events.of_status(self._status.value) if self._status.update() else ():
            events.append((event["text"], time.monotonic_ns()))
        for text, stamp_ns in events:
            self._topics.show_event(text, self._wall(stamp_ns))
        if rows.size:
            self._topics.show(rows, self._wall(int(rows["stamp_ns"][-1])))
            self._messages += 1

    def _describe(self, description: dict[str, Any]) -> None:
        self._events.describe(description)
        names = [str(axis.get("name", "")) for axis in description.get("axes", [])]
        if self._topics is None or names != self._topics.given:
            if self._topics is not None:
                self._server.withdraw()
            self._topics = _Topics(self._server, names, self._block.n)
        try:
            self._topics.scene = CableScene(description)
        except (KeyError, TypeError, ValueError):  # no platform, or an invalid one
            self._topics.scene = None


class _Topics:
    """The topics of one robot; axes have names that message paths can contain."""

    def __init__(self, server: FoxgloveServer, given: Sequence[str], n: int) -> None:
        self.given = list(given)
        self._server = server
        names = [*given, *(f"axis_{k + 1}" for k in range(len(given), n))][:n]
        self._names = _spelled(names)
        axis = _object("Axis", dict.fromkeys((*_AXES.values(), "error_deg"), "number"))
        axes = {"type": "object", "title": "cdpr_rt.Axes"}
        axes["properties"] = dict.fromkeys(self._names, axis)  # type: ignore[assignment]
        self._axes = self._json("/axes", axes)
        tensions = _object("Tensions", dict.fromkeys(self._names, "number"))
        self._tensions = self._json("/tensions", tensions)
        timing = dict.fromkeys((*_TIMES.values(), *_NUMBERS), "number")
        counts = dict.fromkeys(_COUNTS, "integer")
        self._timing = self._json("/cycle_time", _object("CycleTime", {**timing, **counts}))
        words = dict.fromkeys(LABELS, "string")
        self._state = self._json("/state", _object("State", words))
        pose = PoseInFrame.get_schema()
        self._pose = server.advertise("/pose", "protobuf", pose)
        self._wanted = server.advertise("/pose_setpoint", "protobuf", pose)
        self.scene: CableScene | None = None
        """Scene of cables and platform, None for robots without a platform."""
        self._cables = server.advertise("/cables", "protobuf", SceneUpdate.get_schema())
        self._frame = server.advertise("/tf", "protobuf", FrameTransform.get_schema())
        self._log = server.advertise("/log", "protobuf", Log.get_schema())

    def _json(self, name: str, schema: dict[str, Any]) -> Topic:
        data = json.dumps(schema).encode()
        published = Schema(name=schema["title"], encoding="jsonschema", data=data)
        return self._server.advertise(name, "json", published)

    def show_event(self, text: str, time_ns: int) -> None:
        """Show a line in the viewer's log."""
        line = Log(timestamp=_stamp(time_ns), level=LogLevel.Info, message=text, name="cdpr-rt")
        self._server.send(self._log, line.encode(), time_ns)

    def show(self, rows: Row, time_ns: int) -> None:
        """Show the last of `rows`, with the longest durations in all of them."""
        row = rows[-1]
        for topic, value in (
            (self._axes, self._axes_of),
            (self._tensions, self._tensions_of),
            (self._state, _state_of),
        ):
            if self._server.is_wanted(topic):
                self._server.send(topic, json.dumps(value(row)).encode(), time_ns)
        if self._server.is_wanted(self._timing):
            self._server.send(self._timing, json.dumps(_timing_of(rows)).encode(), time_ns)
        if self.scene is not None and self._server.is_wanted(self._cables):
            self._show_cables(self.scene, row, time_ns)
        self._show_pose(row["pose"].tolist(), self._pose, time_ns)
        self._show_pose(row["pose_setpoint"].tolist(), self._wanted, time_ns)

    def _axes_of(self, row: Row) -> dict[str, Any]:
        table: dict[str, dict[str, float]] = {name: {} for name in self._names}
        for field, shown in _AXES.items():
            for name, value in zip(self._names, row[field].tolist(), strict=True):
                if math.isfinite(value):
                    table[name][shown] = math.degrees(value) if field != shown else value
        for one in table.values():
            if {"setpoint_deg", "position_deg"} <= one.keys():
                one["error_deg"] = one["setpoint_deg"] - one["position_deg"]
        return table

    def _tensions_of(self, row: Row) -> dict[str, Any]:
        named = zip(self._names, row["tension_N"].tolist(), strict=True)
        return {name: value for name, value in named if math.isfinite(value)}

    def _show_cables(self, scene: CableScene, row: Row, time_ns: int) -> None:
        pose = np.array(row["pose"], float)
        if np.isfinite(pose).all():
            drawn = scene.update(pose, np.array(row["tension_N"], float), _stamp(time_ns))
            self._server.send(self._cables, drawn.encode(), time_ns)

    def _show_pose(self, pose: list[float], topic: Topic, time_ns: int) -> None:
        if not all(math.isfinite(value) for value in pose):
            return
        x, y, z, qw, qx, qy, qz = pose
        place, turned = Vector3(x=x, y=y, z=z), Quaternion(x=qx, y=qy, z=qz, w=qw)
        stamp = _stamp(time_ns)
        shown = PoseInFrame(
            timestamp=stamp, frame_id="base", pose=Pose(position=place, orientation=turned)
        )
        self._server.send(topic, shown.encode(), time_ns)
        if topic is self._pose:
            transform = FrameTransform(
                timestamp=stamp,
                parent_frame_id="base",
                child_frame_id="platform",
                translation=place,
                rotation=turned,
            )
            self._server.send(self._frame, transform.encode(), time_ns)


def _spelled(names: Sequence[str]) -> list[str]:
    """Return unique names that message paths can contain."""
    spelled: list[str] = []
    for name in names:
        word = re.sub(r"\W", "_", name)
        while word in spelled:
            word += "_"
        spelled.append(word)
    return spelled


def _object(title: str, fields: dict[str, str]) -> dict[str, Any]:
    properties = {name: {"type": kind} for name, kind in fields.items()}
    return {"type": "object", "title": f"cdpr_rt.{title}", "properties": properties}


def _stamp(time_ns: int) -> Timestamp:
    return Timestamp(sec=time_ns // 1_000_000_000, nsec=time_ns % 1_000_000_000)


def _state_of(row: Row) -> dict[str, Any]:
    numbers = {name: int(row[name]) for name in LABELS}
    return {name: LABELS[name].get(number, str(number)) for name, number in numbers.items()}


def _timing_of(rows: Row) -> dict[str, Any]:
    longest = {shown: 1e3 * float(rows[name].max()) for name, shown in _TIMES.items()}
    numbers = {name: float(rows[name][-1]) for name in _NUMBERS}
    known = {name: value for name, value in numbers.items() if math.isfinite(value)}
    return {**longest, **known, **{name: int(rows[name][-1]) for name in _COUNTS}}
