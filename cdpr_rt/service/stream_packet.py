"""Packets of the set-point stream: bytes in and out, checked (docs/reference/setpoint-stream.md).

Little-endian. Every packet begins with magic, version, kind, status and session, and ends with an
HMAC-SHA256 of everything before.
"""

from __future__ import annotations

import hashlib
import hmac
import math
import struct
from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

from cdpr_rt.errors import ControlError

MAGIC: Final = b"CDPS"
VERSION: Final = 1
TAG_BYTES: Final = 32
NONCE_BYTES: Final = 16
RIGHT_BYTES: Final = 16
NO_RIGHT: Final = bytes(RIGHT_BYTES)
"""Replaces the digest of a right to move if the sender holds none."""
SMALLEST_KEY_BYTES: Final = 16
REACH_M: Final = 20.0
"""Largest plausible distance of a position, and of position times scale."""
LARGEST_SCALE: Final = 100.0
UNKNOWN_POSE: Final = (math.nan,) * 7
"""x y z in m and quaternion w x y z of a platform whose pose is unknown."""

_HEAD = struct.Struct("<4sBBHI")
_GREETING = struct.Struct("<4sBBHI4x16s16s16x")
_SETPOINT = struct.Struct("<4sBBHIIQqqq3d4dd16s")
_STATE = struct.Struct("<4sBBHI4BQqq7d7dd")
_BYE = struct.Struct("<4sBBHI4xQ")
_LATEST_NS = 1 << 62
_NORM_TOLERANCE = 0.1


class PacketKind(IntEnum):
    """Kind of a packet; senders send odd kinds, and the robot answers with even kinds."""

    HELLO = 1
    WELCOME = 2
    SETPOINT = 3
    STATE = 4
    BYE = 5


class Standing(IntEnum):
    """Outcome of a set-point in the robot's answer."""

    ACCEPTED = 1
    BUSY = 2
    """Another sender holds the stream."""
    NO_RIGHT = 3
    """Another client holds the right to move, or the named right has ended."""
    TOO_FAST = 4
    """The sender sends more set-points per second than the robot accepts."""
    REPEATED = 5
    """A set-point with this sequence number was accepted before, or this one is far too late."""


class PacketFault(IntEnum):
    """Reason why a packet was dropped without an answer."""

    SIZE = 0
    MAGIC = 1
    VERSION = 2
    KIND = 3
    TAG = 4
    NOT_FINITE = 5
    ABSURD = 6
    UNSIGNED = 7
    """The packet has no tag."""
    SESSION = 8
    """The session does not exist, or the packet comes from another address than that of the
    session."""


class PacketError(ControlError):
    """A packet has a wrong format or impossible content; `fault` is the check that failed."""

    def __init__(self, fault: PacketFault, text: str) -> None:
        self.fault = fault
        super().__init__(text)


@dataclass(frozen=True)
class Hello:
    """A sender that knows the shared key requests the robot's nonce."""

    session: int
    nonce: bytes

    def pack(self) -> bytes:
        """Return the packet without its tag."""
        return _GREETING.pack(
            MAGIC, VERSION, PacketKind.HELLO, 0, self.session, self.nonce, bytes(NONCE_BYTES)
        )


@dataclass(frozen=True)
class Welcome:
    """The robot's nonce, which follows the sender's; the session's key is derived from it."""

    session: int
    nonce: bytes
    robot_nonce: bytes

    def pack(self) -> bytes:
        """Return the packet without its tag."""
        head = MAGIC, VERSION, PacketKind.WELCOME, 0, self.session
        return _GREETING.pack(*head, self.nonce, self.robot_nonce)


@dataclass(frozen=True)
class StreamSession:
    """A session that the control interface has given to the holder of the right to move."""

    number: int
    key: bytes


@dataclass(frozen=True)
class StreamSetpoint:
    """Pose of the input device: position in m, orientation as a unit quaternion w x y z."""

    session: int
    sequence: int
    sent_ns: int
    position_m: tuple[float, float, float]
    quaternion: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    scale: float = 1.0
    buttons: int = 0
    echo_ns: int = 0
    """`robot_ns` of the newest answer, 0 before the first answer."""
    echo_held_ns: int = 0
    """Time from that answer's arrival until this packet was sent."""
    right: bytes = NO_RIGHT
    """First bytes of the SHA-256 of the token that gives the right to move.

    It is used if a session begins with the shared key; a given session already has a right.
    """

    def pack(self) -> bytes:
        """Return the packet without its tag."""
        return _SETPOINT.pack(
            MAGIC, VERSION, PacketKind.SETPOINT, 0, self.session, self.buttons, self.sequence,
            self.sent_ns, self.echo_ns, self.echo_held_ns, *self.position_m, *self.quaternion,
            self.scale, self.right,
        )  # fmt: skip


@dataclass(frozen=True)
class StreamAnswer:
    """The robot's answer to one set-point."""

    session: int
    standing: Standing
    sequence: int
    """Sequence number of the set-point that is answered."""
    sent_ns: int
    """Time of the set-point by the sender's clock."""
    robot_ns: int
    """Time of arrival of the set-point by the robot's clock."""
    state: int = 0
    """Number of the loop's state, see `LoopState`."""
    program: int = 0
    """Number of the running program in the robot's description."""
    reaction: int = 0
    limit: int = 0
    """Number of the limit that caused the reaction, or 0."""
    pose: tuple[float, ...] = UNKNOWN_POSE
    pose_setpoint: tuple[float, ...] = UNKNOWN_POSE
    round_trip_s: float = math.nan
    """Round-trip delay, as last measured by the robot."""

    def pack(self) -> bytes:
        """Return the packet without its tag."""
        return _STATE.pack(
            MAGIC, VERSION, PacketKind.STATE, self.standing, self.session, self.state, self.program,
            self.reaction, self.limit, self.sequence, self.sent_ns, self.robot_ns, *self.pose,
            *self.pose_setpoint, self.round_trip_s,
        )  # fmt: skip


@dataclass(frozen=True)
class Bye:
    """A sender releases the stream for others."""

    session: int
    sequence: int

    def pack(self) -> bytes:
        """Return the packet without its tag."""
        return _BYE.pack(MAGIC, VERSION, PacketKind.BYE, 0, self.session, self.sequence)


Packet = Hello | Welcome | StreamSetpoint | StreamAnswer | Bye
_SIZES: Final = {
    PacketKind.HELLO: _GREETING.size,
    PacketKind.WELCOME: _GREETING.size,
    PacketKind.SETPOINT: _SETPOINT.size,
    PacketKind.STATE: _STATE.size,
    PacketKind.BYE: _BYE.size,
}
LONGEST_BYTES: Final = max(_SIZES.values()) + TAG_BYTES


def peek(data: bytes) -> tuple[PacketKind, int]:
    """Return kind and session of a packet after a check of header and length; raises
    PacketError.
    """
    if len(data) < _HEAD.size:
        raise PacketError(PacketFault.SIZE, f"{len(data)} bytes are not a packet")
    magic, version, number, _, session = _HEAD.unpack_from(data)
    if magic != MAGIC:
        raise PacketError(PacketFault.MAGIC, f"begins with {magic!r}, not {MAGIC!r}")
    if version != VERSION:
        raise PacketError(PacketFault.VERSION, f"version {version}; allowed: {VERSION}")
    try:
        kind = PacketKind(number)
    except ValueError:
        raise PacketError(
            PacketFault.KIND, f"kind {number}; allowed: 1 to {max(PacketKind)}"
        ) from None
    size = _SIZES[kind] + TAG_BYTES
    if len(data) == _SIZES[kind]:
        raise PacketError(PacketFault.UNSIGNED, f"{kind.name}: without a tag")
    if len(data) != size:
        raise PacketError(PacketFault.SIZE, f"{kind.name}: {len(data)} bytes; allowed: {size}")
    return kind, session


def parse(data: bytes, key: bytes) -> Packet:
    """Parse a packet whose tag was made with `key`; raises PacketError."""
    kind, session = peek(data)
    body, tag = data[:-TAG_BYTES], data[-TAG_BYTES:]
    if not hmac.compare_digest(tag, _tag(body, key)):
        raise PacketError(PacketFault.TAG, "the tag was not made with this key")
    if session == 0:
        raise PacketError(PacketFault.ABSURD, "session 0; allowed: 1 to 4294967295")
    return _PARSERS[kind](data)


def seal(packet: Packet, key: bytes) -> bytes:
    """Return a packet's bytes with its tag."""
    body = packet.pack()
    return body + _tag(body, key)


def stream_key(shared: bytes) -> bytes:
    """Return the key of the stream, derived from the daemon's key `shared`.

    Raises ControlError for a key that is too short.
    """
    if len(shared) < SMALLEST_KEY_BYTES:
        raise ControlError(
            f"the key has {len(shared)} bytes; allowed: at least {SMALLEST_KEY_BYTES}"
        )
    return hmac.digest(shared, b"cdpr-rt set-point stream 1", "sha256")


def session_key(key: bytes, robot_nonce: bytes, session: int) -> bytes:
    """Return the key of one session, which is void after the robot has replaced its nonce."""
    return hmac.digest(key, robot_nonce + session.to_bytes(4, "little"), "sha256")


def right_digest(token: str) -> bytes:
    """Return the digest of the token of the right to move that a packet carries."""
    return hashlib.sha256(token.encode()).digest()[:RIGHT_BYTES]


def _tag(body: bytes, key: bytes) -> bytes:
    return hmac.digest(key, body, "sha256")


def _parse_hello(data: bytes) -> Hello:
    _, _, _, _, session, nonce, _ = _GREETING.unpack_from(data)
    return Hello(session, nonce)


def _parse_welcome(data: bytes) -> Welcome:
    _, _, _, _, session, nonce, robot_nonce = _GREETING.unpack_from(data)
    return Welcome(session, nonce, robot_nonce)


def _parse_setpoint(data: bytes) -> StreamSetpoint:
    values = _SETPOINT.unpack_from(data)
    session, buttons, sequence, sent_ns, echo_ns, echo_held_ns = values[4:10]
    position, attitude, scale, right = values[10:13], values[13:17], values[17], values[18]
    if not all(map(math.isfinite, values[10:18])):
        raise PacketError(PacketFault.NOT_FINITE, "position, orientation or scale is not finite")
    if not 0.0 < scale <= LARGEST_SCALE:
        raise PacketError(
            PacketFault.ABSURD, f"scale {scale}; allowed: above 0, to {LARGEST_SCALE:g}"
        )
    if math.hypot(*position) * max(1.0, scale) > REACH_M:
        raise PacketError(PacketFault.ABSURD, f"position {position} m; allowed: to {REACH_M:g} m")
    norm = math.hypot(*attitude)
    if abs(norm - 1.0) > _NORM_TOLERANCE:
        raise PacketError(PacketFault.ABSURD, f"quaternion {attitude}; allowed: of length 1")
    if not 0 <= sent_ns < _LATEST_NS:
        raise PacketError(PacketFault.ABSURD, f"sent_ns {sent_ns}; allowed: 0 to 2^62")
    w, x, y, z = (part / norm for part in attitude)
    return StreamSetpoint(
        session, sequence, sent_ns, position, (w, x, y, z), scale, buttons, echo_ns,
        echo_held_ns, right,
    )  # fmt: skip


def _parse_state(data: bytes) -> StreamAnswer:
    values = _STATE.unpack_from(data)
    try:
        standing = Standing(values[3])
    except ValueError:
        raise PacketError(PacketFault.ABSURD, f"status {values[3]} is unknown") from None
    session, state, program, reaction, limit = values[4:9]
    sequence, sent_ns, robot_ns = values[9:12]
    return StreamAnswer(
        session, standing, sequence, sent_ns, robot_ns, state, program, reaction, limit,
        values[12:19], values[19:26], values[26],
    )  # fmt: skip


def _parse_bye(data: bytes) -> Bye:
    *_, session, sequence = _BYE.unpack_from(data)
    return Bye(session, sequence)


_PARSERS: Final[dict[PacketKind, Callable[[bytes], Packet]]] = {
    PacketKind.HELLO: _parse_hello,
    PacketKind.WELCOME: _parse_welcome,
    PacketKind.SETPOINT: _parse_setpoint,
    PacketKind.STATE: _parse_state,
    PacketKind.BYE: _parse_bye,
}
