"""Tables from logs of messages: candump with a drive's PDO map, and MCAP with JSON messages."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

from cdpr_drivers.decode.candump import read_log
from cdpr_drivers.decode.decoder import Decoder, KnownNode
from cdpr_profiles import Winch
from cdpr_profiles.bounded_input import read_bytes
from cdpr_profiles.errors import ProfileError
from cdpr_tools.imports.tables import MOST_BYTES, TIME, Table, read_table

_MCAP: Final = b"\x89MCAP0\r\n"
_CANDUMP: Final = re.compile(rb"\s*\(\d+\.\d+\)\s+\S+\s+[0-9A-Fa-f]+#")
_POSITION: Final = 0x6064
_DEEPEST: Final = 8


def read_any(path: Path, winches: Mapping[str, Winch] | None = None) -> Table:
    """Read a table, an MCAP file, or with winches a candump log; raises ProfileError.

    `winches` has the prefix of each winch's columns as key, such as "left.".
    """
    data = read_bytes(path, MOST_BYTES)
    if data.startswith(_MCAP):
        return _read_mcap(path, data)
    if winches is not None and _CANDUMP.match(data):
        return _read_candump(path, data, winches)
    return read_table(path)


def _read_candump(path: Path, data: bytes, winches: Mapping[str, Winch]) -> Table:
    """Return the values in PDOs: a row for each position of a drive, columns such as "6077".

    The drives' profiles have the PDO maps, unless the log contains their configuration. Values are
    in the units that `units` states. The time of a row is that of the SYNC before it.
    """
    nodes = {winch.node_id: (prefix, winch) for prefix, winch in winches.items()}
    decoder = Decoder({node: KnownNode.of_winch(winch) for node, (_, winch) in nodes.items()})
    rows: list[dict[str, float]] = []
    units = {TIME: "s"}
    sync_s: float | None = None
    row: dict[str, float] = {}
    for _, frame in read_log(str(path), data.decode("ascii", "replace").splitlines(keepends=True)):
        record = decoder.decode(frame)
        sync_s = frame.time_s if record.kind == "SYNC" else sync_s
        if record.node_id not in nodes or not record.kind.startswith(("TPDO", "RPDO")):
            continue
        prefix, _ = nodes[record.node_id]
        for value in record.fields:
            if isinstance(value.value, str):
                continue
            name = f"{prefix}{value.index:04X}"
            if value.index == _POSITION and name in row:
                rows.append(row)
                row = {}
            row.setdefault(TIME, frame.time_s if sync_s is None else sync_s)
            row[name] = float(value.value)
            units[name] = value.unit
    if rows and row.keys() >= rows[-1].keys():  # the log may end within a cycle
        rows.append(row)
    if not rows:
        ids = ", ".join(str(node) for node in nodes)
        raise ProfileError(
            path,
            "",
            f"no positions (6064h) of node {ids}; check node_id and the PDO map of the drive's "
            "profile",
        )
    return _joined(path, data, rows, units)


def _read_mcap(path: Path, data: bytes) -> Table:
    """Return the numbers in JSON messages: a row for each message of the most frequent topic.

    Columns are named "topic.key"; a value of another topic holds until its next message.
    """
    # imported here: other files do not need it
    from mcap.exceptions import McapError  # noqa: PLC0415
    from mcap.reader import make_reader  # noqa: PLC0415

    found: list[tuple[str, float, dict[str, float]]] = []
    try:
        with path.open("rb") as file:
            for _, channel, message in make_reader(file).iter_messages():
                if channel.message_encoding != "json":
                    problem = f"{channel.message_encoding!r} messages; allowed: json"
                    raise ProfileError(path, channel.topic, f"{problem}; export them as CSV")
                values = json.loads(message.data)
                topic = channel.topic.lstrip("/")
                numbers = {f"{topic}{key}": value for key, value in _numbers(values)}
                found.append((topic, 1e-9 * message.log_time, numbers))
    except (McapError, ValueError) as error:
        raise ProfileError(path, "", f"cannot be read as MCAP: {error}") from None
    if not found:
        raise ProfileError(path, "", "contains no messages")
    topics = [topic for topic, _, _ in found]
    most = max(set(topics), key=topics.count)
    rows: list[dict[str, float]] = []
    held: dict[str, float] = {}
    for topic, time, numbers in found:
        held |= numbers
        if topic == most:
            rows.append({TIME: time, **held})
    return _joined(path, data, rows, {TIME: "s"})


def _numbers(value: Any, key: str = "", depth: int = 0) -> Iterator[tuple[str, float]]:
    """Yield the key and the value of each number inside a JSON value."""
    if isinstance(value, (int, float)):
        yield key, float(value)
    elif isinstance(value, dict) and depth < _DEEPEST:
        for name, part in value.items():
            yield from _numbers(part, f"{key}.{name}", depth + 1)
    elif isinstance(value, list) and depth < _DEEPEST:
        for place, part in enumerate(value):
            yield from _numbers(part, f"{key}[{place}]", depth + 1)


def _joined(
    path: Path, data: bytes, rows: list[dict[str, float]], units: Mapping[str, str]
) -> Table:
    names = list(dict.fromkeys(name for row in rows for name in row))
    columns = {name: np.array([row.get(name, np.nan) for row in rows]) for name in names}
    lines = np.arange(1, len(rows) + 1)
    return Table(path, hashlib.sha256(data).hexdigest(), columns, lines, dict(units))
