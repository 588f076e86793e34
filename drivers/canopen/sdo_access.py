"""Objects of the nodes of one bus, read and written by SDO."""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import Any, TypeVar

from canopen.objectdictionary import ObjectDictionary, ObjectDictionaryError, ODVariable

from cdpr_drivers.canopen import sdo_abort
from cdpr_drivers.canopen.emergency import ErrorRecord
from cdpr_drivers.canopen.sdo import SdoClient
from cdpr_drivers.canopen.sdo_frames import REQUEST
from cdpr_drivers.errors import (
    BusError,
    SdoAbortError,
    SdoCancelledError,
    SdoError,
    SdoTimeoutError,
)
from cdpr_rt.core.clock import Clock

_TIMEOUT_S = 0.5
_ATTEMPTS = 2
_HISTORY = 0x1003

T = TypeVar("T")
Send = Callable[[int, bytes], None]


class ObjectAccess:
    """SDO access to several nodes; in tasks transfers to different nodes run side by side.

    Errors name node, object and reason. A request without an answer is repeated up to `attempts`
    in all; `timeout_s` is that of one answer.
    """

    def __init__(self, send: Send, clock: Clock) -> None:
        self.clock = clock
        self._send = send
        self.clients: dict[int, SdoClient] = {}
        """The SDO client of each node."""
        self._dictionaries: dict[int, ObjectDictionary] = {}

    def add_node(self, node_id: int, dictionary: ObjectDictionary) -> None:
        """Add a node with the object dictionary of its EDS."""
        self._dictionaries[node_id] = dictionary

        def send(data: bytes) -> None:
            self._send(REQUEST + node_id, data)

        self.clients[node_id] = SdoClient(send, self.clock)

    def dictionary(self, node_id: int) -> ObjectDictionary:
        """Return the node's object dictionary."""
        return self._dictionaries[node_id]

    def read(
        self, node_id: int, index: int, sub: int = 0, *, attempts: int = _ATTEMPTS
    ) -> int | str | bytes:
        """Return an object's value, decoded by its type; raises SdoError, BusError."""
        variable = self._variable(node_id, index, sub)

        def transfer(client: SdoClient) -> Any:
            data = client.upload(index, sub, _TIMEOUT_S)
            # some devices send four bytes whatever the type
            return variable.decode_raw(data[: len(variable) // 8] if variable.fixed_size else data)

        value = self._transfer(node_id, index, sub, "read", transfer, attempts)
        return value if isinstance(value, int | str) else bytes(value)

    def read_int(self, node_id: int, index: int, sub: int = 0, *, attempts: int = _ATTEMPTS) -> int:
        """Return an integer object's value; raises SdoError, BusError."""
        value = self.read(node_id, index, sub, attempts=attempts)
        if not isinstance(value, int):
            raise SdoError(f"node {node_id}: object {index:04X}h:{sub} is no integer: {value!r}")
        return value

    def read_bytes(self, node_id: int, index: int, sub: int = 0, *, block: bool = False) -> bytes:
        """Return an object's raw data, also where the EDS does not have it.

        With `block` by block transfer, where the node can, which is several times faster for long
        data. Raises SdoError, BusError.
        """
        return self._transfer(
            node_id,
            index,
            sub,
            "read",
            lambda client: client.upload(index, sub, _TIMEOUT_S, block=block),
            _ATTEMPTS,
        )

    def write(
        self, node_id: int, index: int, sub: int, value: int, *, timeout_s: float = _TIMEOUT_S
    ) -> None:
        """Write an integer object; raises SdoError, BusError."""
        variable = self._variable(node_id, index, sub)

        def transfer(client: SdoClient) -> None:
            client.download(index, sub, bytes(variable.encode_raw(value)), timeout_s)

        self._transfer(node_id, index, sub, f"set to {value}", transfer, _ATTEMPTS)

    def write_bytes(self, node_id: int, index: int, sub: int, data: bytes) -> None:
        """Write an object's data as they are; raises SdoError, BusError."""
        number = f"{data[::-1].hex().upper()}h"  # as CiA 301 writes it, the highest byte first
        what = f"set to {number if len(data) <= 8 else f'{len(data)} bytes'}"

        def transfer(client: SdoClient) -> None:
            client.download(index, sub, data, _TIMEOUT_S)

        self._transfer(node_id, index, sub, what, transfer, _ATTEMPTS)

    def cancel(self, node_id: int) -> bool:
        """Have the transfer with a node that a task runs end; return whether one ran.

        That task gets SdoCancelledError, the node an abort (08000000h).
        """
        return self.clients[node_id].cancel()

    def error_history(self, node_id: int) -> list[ErrorRecord]:
        """Return the node's own history of errors (1003h), the newest first.

        Raises SdoError, BusError.
        """
        records = []
        for sub in range(1, self.read_int(node_id, _HISTORY) + 1):
            try:
                value = self.read_int(node_id, _HISTORY, sub)
            except SdoAbortError as error:
                if error.code in (sdo_abort.NO_DATA, sdo_abort.NO_SUBINDEX):
                    break  # cleared meanwhile
                raise
            records.append(ErrorRecord(value & 0xFFFF, value >> 16))
        return records

    # -- how

    def _transfer(
        self,
        node_id: int,
        index: int,
        sub: int,
        what: str,
        transfer: Callable[[SdoClient], T],
        attempts: int,
    ) -> T:
        where = f"node {node_id}: object {index:04X}h:{sub} cannot be {what}: "
        client = self.clients[node_id]
        while True:
            attempts -= 1
            try:
                return transfer(client)
            except SdoTimeoutError as error:
                if not attempts:
                    raise SdoTimeoutError(f"{where}{error}") from error
            except SdoAbortError as error:
                raise SdoAbortError(error.code, where) from error
            except SdoCancelledError as error:
                raise SdoCancelledError(f"{where}{error}") from error
            except (struct.error, ObjectDictionaryError, ValueError, TypeError) as error:
                raise SdoError(
                    f"{where}its value does not fit the type that the EDS gives it ({error})"
                ) from error

    def _variable(self, node_id: int, index: int, sub: int) -> ODVariable:
        try:
            entry: Any = self._dictionaries[node_id][index]
            variable = entry if isinstance(entry, ODVariable) else entry[sub]
        except KeyError:
            variable = None
        if not isinstance(variable, ODVariable):
            raise SdoError(f"node {node_id}: object {index:04X}h:{sub} is not in the drive's EDS")
        return variable

    def _fail_transfers(self, error: BusError) -> None:
        """End every transfer at once: the bus has gone away."""
        for client in self.clients.values():
            client.fail(error)
