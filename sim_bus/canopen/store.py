"""Non-volatile memory of a simulated device: stored parameters, LSS configuration and stamp."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable, Collection
from pathlib import Path
from typing import Any

from cdpr_profiles.bounded_input import read_json, replacing
from cdpr_profiles.errors import ProfileError, brief
from cdpr_profiles.winch import BITRATES_bit_s
from cdpr_sim_bus.canopen.abort import Abort, SdoAbort
from cdpr_sim_bus.canopen.od import APPLICATION, Entry, ObjectDictionary, Value
from cdpr_sim_bus.errors import SimulatorError

Hook = Callable[[Value], None]


class StoreError(SimulatorError):
    """A parameter file cannot be read."""


class ParameterStore:
    """Stored parameters, in a JSON file if `path` is given, else in memory.

    Only values that differ from the default are stored, so that COB-IDs which depend on the node id
    follow it. `volatile` lists indexes that are never stored: process data such as controlword and
    targets. Raises StoreError if the file exists and is not a parameter file.
    """

    def __init__(self, path: Path | None = None, volatile: Collection[int] = ()) -> None:
        self._path = path
        self._volatile = frozenset(volatile) | {0x1003, 0x1010, 0x1011}
        self._values: dict[str, str | int | float] = {}
        self.node_id: int | None = None
        """Node id stored by LSS."""
        self.bitrate: int | None = None
        """Bit rate stored by LSS, bit/s."""
        if path is not None and path.exists():
            self._read(path)

    def _read(self, path: Path) -> None:
        try:
            self._values, self.node_id, self.bitrate = _parts(read_json(path))
        except ProfileError as error:
            raise StoreError(str(error)) from None
        except (ValueError, KeyError, TypeError) as error:
            raise StoreError(f"{path}: not a parameter file: {error!r}") from error

    def check(self, od: ObjectDictionary) -> None:
        """Raise StoreError for a stored value that its object cannot hold."""
        for entry in od:
            try:
                value = self._stored(entry)
                if value is not None:
                    entry.codec.encode(value)
            except (ValueError, TypeError, AttributeError, OverflowError, struct.error):
                key = _key(entry)
                raise StoreError(
                    f"{self._path}: values.{key}: value {brief(repr(self._values[key]))}; allowed: "
                    f"a value of {entry.index:04X}h:{entry.sub}"
                ) from None

    def keeps(self, index: int) -> bool:
        """Return whether an object is a parameter, which 1010h stores."""
        return index not in self._volatile

    def write(self) -> None:
        """Write the file; raises SdoAbort with a hardware error if that fails."""
        if self._path is None:
            return
        content = {"node_id": self.node_id, "bitrate": self.bitrate, "values": self._values}
        try:
            with replacing(self._path) as file:
                file.write(json.dumps(content, indent=1).encode() + b"\n")
        except OSError as error:
            raise SdoAbort(Abort.HARDWARE_ERROR) from error

    def save(self, od: ObjectDictionary, area: range) -> None:
        """Store the writable values of an area; raises SdoAbort if they cannot be stored."""
        for entry in od:
            if entry.index in area and entry.access in ("rw", "rww", "rwr"):
                self._values.pop(_key(entry), None)
                value = entry.value
                if entry.index not in self._volatile and value != entry.default:
                    self._values[_key(entry)] = value.hex() if isinstance(value, bytes) else value
        self.write()

    def restore_defaults(self, od: ObjectDictionary, area: range) -> None:
        """Delete the stored values of an area; this takes effect at the next reset."""
        for entry in od:
            if entry.index in area:
                self._values.pop(_key(entry), None)
        self.write()

    def load(self, od: ObjectDictionary) -> None:
        """Give the stored values to the dictionary as its power-on values."""
        for entry in od:
            entry.stored = self._stored(entry)

    def _stored(self, entry: Entry) -> Value | None:
        value = self._values.get(_key(entry))
        if isinstance(value, str) and isinstance(entry.codec.zero, bytes):
            return bytes.fromhex(value)
        return value


def _parts(held: Any) -> tuple[dict[str, str | int | float], int | None, int | None]:
    """Return values, node id and bit rate; raises ValueError, KeyError or TypeError."""
    values, node_id, bitrate = dict(held["values"]), held["node_id"], held["bitrate"]
    for key, value in values.items():
        bytes.fromhex(key)
        if not isinstance(value, str | int | float):
            raise ValueError(f"value of {key}")
    if type(node_id) not in (int, type(None)) or node_id not in (None, *range(1, 128), 255):
        raise ValueError(f"node_id {node_id!r}; allowed: null, 1 to 127, 255")
    if type(bitrate) not in (int, type(None)) or bitrate not in (None, *BITRATES_bit_s):
        raise ValueError(f"bitrate {bitrate!r}; allowed: null, {BITRATES_bit_s}")
    return values, node_id, bitrate


def _key(entry: Entry) -> str:
    return f"{entry.index:04X}{entry.sub:02X}"


_SAVE = int.from_bytes(b"save", "little")
_LOAD = int.from_bytes(b"load", "little")
_AREAS = {
    1: range(0x1000, 0xC000),
    2: range(0x1000, 0x2000),
    3: range(0x6000, 0xA000),
    4: range(0x2000, 0x6000),
}
"""Area of the dictionary by sub-index of 1010h and 1011h."""
_ON_COMMAND = 1


def add_store_objects(store: ParameterStore, od: ObjectDictionary) -> None:
    """Add 1010h, which stores parameters ("save"), and 1011h, which restores them ("load")."""

    def hook(area: range, signature: int, act: Callable[[ObjectDictionary, range], None]) -> Hook:
        def write(value: Value) -> None:
            if value != signature:
                raise SdoAbort(Abort.CANNOT_STORE)
            act(od, area)

        return write

    for index, signature, act in (
        (0x1010, _SAVE, store.save),
        (0x1011, _LOAD, store.restore_defaults),
    ):
        for entry in od.subs(index):
            if entry.sub in _AREAS:
                entry.getter = lambda: _ON_COMMAND
                entry.hook = hook(_AREAS[entry.sub], signature, act)


_VERIFY = 0x1020


class ConfigurationStamp:
    """Maintains 1020h as CiA 301 specifies: 0 from the first change after it was written.

    A communication reset restores the stored date and time together with the communication
    parameters. It does not restore application parameters; if these have changed in the meantime,
    1020h stays 0.
    """

    def __init__(self, od: ObjectDictionary, store: ParameterStore) -> None:
        self._od = od
        self._store = store
        self._application_changed = False

    def written(self, entry: Entry, before: Value) -> None:
        """Record that a client wrote to an object whose value was `before`."""
        if entry.index == _VERIFY:
            self._application_changed = False
        elif entry.value != before and self._store.keeps(entry.index):
            self._application_changed = self._application_changed or entry.index in APPLICATION
            self._clear()

    def reset_node(self) -> None:
        """Handle a node reset: all parameters have their stored values again."""
        self._application_changed = False

    def reset_communication(self) -> None:
        """Handle a communication reset, which restores the stored communication parameters."""
        if self._application_changed:
            self._clear()

    def _clear(self) -> None:
        for entry in self._od.subs(_VERIFY):
            entry.value = 0
