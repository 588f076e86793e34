"""Live view: what Foxglove shows of a running robot, over WebSocket on this machine alone."""

from __future__ import annotations

import asyncio
import json
import math
import re
import socket
import time
from collections.abc import Callable, Collection, Sequence
from typing import Any, Final

import numpy as np
from foxglove import Schema
from foxglove.messages import (
    FrameTransform,
    Log,
    LogLevel,
    Pose,
    PoseInFrame,
    Quaternion,
    SceneUpdate,
    Timestamp,
    Vector3,
)

from cdpr_rt.core.cycle_row import AXIS_FIELDS, SCALAR_FIELDS, Row
from cdpr_rt.core.shared_block import RowReader, SharedBlock, SharedBlockError
from cdpr_rt.service.part import Part
from cdpr_rt.service.recordings.recording import WallClock
from cdpr_rt.service.recordings.recording_events import EventDetector
from cdpr_rt.service.rows import LABELS
from cdpr_rt.service.view.cable_scene import CableScene
from cdpr_rt.service.view.foxglove_server import FoxgloveServer, Topic

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
    """Shows the newest row of a block `RATE_Hz` times a second to whoever connects to `listener`.

    Only what is subscribed to is prepared. Clients cannot change anything. `origins` are those web
    pages that may look on too.
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
        self._versions = {"description": 0, "status": 0}
        self._topics: _Topics | None = None
        self._server = FoxgloveServer(f"cdpr-rt {robot}", origins)
        self._url = "ws://{}:{}".format(*listener.getsockname())
        self._messages = 0

    def status(self) -> dict[str, Any]:
        """Return the URL to connect to, the number of moments shown, and what is wrong.

        Also how many look on, how many were refused, and why the last of them.
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
        description = self._changed("description")
        if description:
            self._describe(description)
        rows = self._reader.read()
        if self._topics is None:
            return  # nobody has said yet what the axes are called
        events = [(event["text"], stamp) for event, stamp in self._events.of_rows(rows)]
        status = self._changed("status")
        for event in self._events.of_status(status) if status else ():
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
        except (KeyError, TypeError, ValueError):  # no platform, or not as it should be
            self._topics.scene = None

    def _changed(self, name: str) -> dict[str, Any] | None:
        version = int(self._block.counters[name][0])
        if version == self._versions[name]:
            return None
        try:
            value = self._block.description() if name == "description" else self._block.status()
        except SharedBlockError:
            return None
        self._versions[name] = version
        return value


class _Topics:
    """The topics of one robot; axes by their names, which message paths can spell."""

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
        """Scene of cables and platform, None of robots without a platform."""
        self._cables = server.advertise("/cables", "protobuf", SceneUpdate.get_schema())
        self._frame = server.advertise("/tf", "protobuf", FrameTransform.get_schema())
        self._log = server.advertise("/log", "protobuf", Log.get_schema())

    def _json(self, name: str, schema: dict[str, Any]) -> Topic:
        data = json.dumps(schema).encode()
        published = Schema(name=schema["title"], encoding="jsonschema", data=data)
        return self._server.advertise(name, "json", published)

    def show_event(self, text: str, time_ns: int) -> None:
        """Put a line into the log."""
        line = Log(timestamp=_stamp(time_ns), level=LogLevel.Info, message=text, name="cdpr-rt")
        self._server.send(self._log, line.encode(), time_ns)

    def show(self, rows: Row, time_ns: int) -> None:
        """Show the last of `rows`, and the longest times of all of them."""
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
    """Return the names as message paths can spell them, each of its own."""
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
