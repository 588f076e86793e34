"""The physics board: a small shared file through which simulated devices interact.

The simulated drives write the true state of motor and cable. Simulated sensors, safety
devices and operators, each in a separate process, read it and write power, brake and mass.
"""

from __future__ import annotations

import math
import mmap
import platform
import struct
import time
from collections.abc import Callable, Sequence
from enum import Enum, IntFlag
from pathlib import Path
from typing import Any, NamedTuple, Self, TypeVar

from cdpr_profiles.bounded_input import replacing
from cdpr_sim_bus.errors import BusSetupError

_T = TypeVar("_T")
_HEADER = struct.Struct("<8sIII")
_MAGIC = b"cdprPHB2"
_MAX_AXES = 256
# on other processors, a reader may see a sequence number before the data that it protects
_IN_ORDER = ("x86_64", "i686", "i386")
# Each field has 8 bytes. The drive's own part comes first, after its sequence number. Then come the
# inputs that other processes write.
_SEQUENCE, _TIME, _TENSION, _ANGLE, _SPEED, _POWER_ON, _COUNT = range(7)
_POWER_FROM, _POWER_UNTIL, _BRAKE_FROM, _BRAKE_UNTIL, _MASS = range(7, 12)
# faults that the drive's simulator injects into other devices
_CELL_FAULT, _IO_FAULTS = 12, 13
# then the tension history, a ring buffer of times and tensions, also written by the drive
_SAMPLES, _SPACING_S = 512, 0.9e-3
_RING = 16
_WORDS = _RING + 2 * _SAMPLES
# in the board's own part, after its header: the platform's sequence number, time and motion
_PLATFORM, _MOTION = 8, 1 + 3 + 9 + 3 + 3
_ALWAYS, _NEVER = (-math.inf, math.inf), (-math.inf, -math.inf)
_SPINS, _TRIES = 100, 1000
_PAUSE_S = 5e-4

Window = tuple[float, float]
"""Bus times at which a condition begins and ends."""


class TensionFault(Enum):
    """Faults that a simulated amplifier or its line can show; the values are their names."""

    NONE = "mend"
    OVER_RANGE = "over-range"
    BROKEN_WIRE = "broken-wire"
    SILENT = "silent"
    TRUNCATED = "truncated"
    WRONG_CRC = "wrong-crc"
    WRONG_UNIT = "wrong-unit"


class SafetyIoFault(IntFlag):
    """Faults of a simulated safety I/O, register 1 of its panel."""

    SILENT = 1
    TRUNCATED = 2
    WRONG_UNIT = 4
    EXCEPTIONS = 8
    CONTACTOR_WELDED = 16
    FEEDBACK_STUCK = 32
    """The contactor's feedback does not change."""
    BRAKES_WORN = 64
    """Brakes do not hold although their feedback reports applied."""
    BRAKES_STUCK = 128
    """Brakes and their feedback do not change."""
    PRESSED = 256
    """An emergency stop button is pressed; only by the physics board."""


_CELL_FAULTS = tuple(TensionFault)


class BoardState(NamedTuple):
    """State of an axis as last written by its drive; all values belong to one instant."""

    time_s: float
    """Bus time."""
    tension_N: float
    """True tension of the cable; 0 if it is slack."""
    motor_rad: float
    """True mechanical angle of the motor over all turns."""
    motor_rad_s: float
    power_on: bool
    """Whether the power stage is on."""


class PlatformState(NamedTuple):
    """True state of a platform, with its frame's origin in the room; all at one instant."""

    time_s: float
    """Bus time."""
    position_m: tuple[float, ...]
    rotation: tuple[float, ...]
    """From the platform's frame to the room, row by row, 9 numbers."""
    velocity_m_s: tuple[float, ...]
    spin_rad_s: tuple[float, ...]
    """Components along the axes of the room."""


class BoardPlatform:
    """State of the simulated platform. The robot publishes it; all devices may read it."""

    def __init__(self, words: memoryview[int], numbers: memoryview[float]) -> None:
        self._words, self._numbers = words, numbers

    def publish(self, state: PlatformState) -> None:
        """Write the platform's state; only its robot may call it."""
        words, numbers = self._words, self._numbers
        sequence = words[0] | 1
        words[0] = sequence
        flat = (state[0], *state[1], *state[2], *state[3], *state[4])
        for i, number in enumerate(flat, 1):
            numbers[i] = number
        words[0] = (sequence + 1) & 0xFFFFFFFFFFFFFFFF

    def state(self) -> PlatformState | None:
        """Return the last published state; None if there is no platform."""
        flat = _consistent(self._words, 0, self._numbers[1 : 1 + _MOTION].tolist)
        if not self._words[0]:
            return None
        parts = (tuple(flat[i:j]) for i, j in ((1, 4), (4, 13), (13, 16), (16, 19)))
        return PlatformState(flat[0], *parts)


class BoardAxis:
    """One axis of a board. The drive calls `publish`; other devices call the setters; all may read.

    Every field has one writer. Reads of the drive's part are consistent, because they are repeated
    if a write occurs. This sequence lock needs stores that become visible in order, see `attach`.
    """

    def __init__(self, words: memoryview[int], numbers: memoryview[float]) -> None:
        self._words = words
        self._numbers = numbers
        self._sample_s = -math.inf

    # -- written by the drive

    def publish(
        self,
        time_s: float,
        tension_N: float,
        motor_rad: float,
        motor_rad_s: float,
        power_on: bool,
    ) -> None:
        """Write the state of the axis; only its drive may call it."""
        words, numbers = self._words, self._numbers
        # an odd number marks a write in progress, or a writer that died in it
        sequence = words[_SEQUENCE] | 1
        words[_SEQUENCE] = sequence
        numbers[_TIME] = time_s
        numbers[_TENSION] = tension_N
        numbers[_ANGLE] = motor_rad
        numbers[_SPEED] = motor_rad_s
        numbers[_POWER_ON] = 1.0 if power_on else 0.0
        if time_s >= self._sample_s:
            self._sample_s = time_s + _SPACING_S
            count = words[_COUNT]
            at = _RING + 2 * (count % _SAMPLES)
            numbers[at], numbers[at + 1] = time_s, tension_N
            words[_COUNT] = count + 1
        words[_SEQUENCE] = (sequence + 1) & 0xFFFFFFFFFFFFFFFF

    @property
    def time_s(self) -> float:
        """Bus time that the drive has reached."""
        return self._numbers[_TIME]

    def state(self) -> BoardState:
        """Return the last state that the drive wrote; possibly incomplete if the drive died."""
        numbers = _consistent(self._words, _SEQUENCE, self._numbers[_TIME : _POWER_ON + 1].tolist)
        time_s, tension, angle, speed, power = numbers
        return BoardState(time_s, tension, angle, speed, power != 0.0)

    def tension_history(self, after: int) -> tuple[int, list[Window]]:
        """Return the number of tension samples so far, and the samples after number `after`.

        A sample is (bus time, tension in N). At most one a millisecond is stored, and the last
        `_SAMPLES` are kept.
        """
        count, ring = _consistent(
            self._words,
            _SEQUENCE,
            lambda: (self._words[_COUNT], self._numbers[_RING:_WORDS].tolist()),
        )
        places = (2 * (i % _SAMPLES) for i in range(max(after, count - _SAMPLES), count))
        return count, [(ring[at], ring[at + 1]) for at in places]

    # -- written by other devices

    @property
    def power_allowed(self) -> bool:
        """Whether the drive may have power; False is a safe torque off."""
        return self.allows_power(self.time_s)

    @power_allowed.setter
    def power_allowed(self, allowed: bool) -> None:
        self.allow_power(_ALWAYS if allowed else _NEVER)

    def allow_power(self, when: Window) -> None:
        """Allow power to the drive during `when`; a later end can be written in advance."""
        self._numbers[_POWER_FROM], self._numbers[_POWER_UNTIL] = when

    def allows_power(self, at_s: float) -> bool:
        """Return whether the drive may have power at a bus time."""
        return self._numbers[_POWER_FROM] <= at_s < self._numbers[_POWER_UNTIL]

    @property
    def brake_released(self) -> bool:
        """Whether the brake is released, so that the rotor can turn."""
        return self.releases_brake(self.time_s)

    @brake_released.setter
    def brake_released(self, released: bool) -> None:
        self.release_brake(_ALWAYS if released else _NEVER)

    def release_brake(self, when: Window) -> None:
        """Release the brake during `when`."""
        self._numbers[_BRAKE_FROM], self._numbers[_BRAKE_UNTIL] = when

    def releases_brake(self, at_s: float) -> bool:
        """Return whether the brake is released at a bus time."""
        return self._numbers[_BRAKE_FROM] <= at_s < self._numbers[_BRAKE_UNTIL]

    def next_change_s(self, after_s: float) -> float:
        """Return the next known bus time at which power or brake change."""
        changes = self._numbers[_POWER_FROM:_MASS]
        return min([at_s for at_s in changes if at_s > after_s], default=math.inf)

    @property
    def cell_fault(self) -> TensionFault:
        """Fault of the cable's load cell; the drive writes it."""
        return _CELL_FAULTS[self._words[_CELL_FAULT]]

    @cell_fault.setter
    def cell_fault(self, fault: TensionFault) -> None:
        self._words[_CELL_FAULT] = _CELL_FAULTS.index(fault)

    @property
    def io_faults(self) -> SafetyIoFault:
        """Faults of the safety I/O; the first axis' drive writes them."""
        return SafetyIoFault(self._words[_IO_FAULTS])

    @io_faults.setter
    def io_faults(self, faults: SafetyIoFault) -> None:
        self._words[_IO_FAULTS] = faults

    @property
    def hung_mass_kg(self) -> float:
        """Mass on the cable, if the plant's load is a hung mass."""
        return float(self._numbers[_MASS])

    @hung_mass_kg.setter
    def hung_mass_kg(self, mass_kg: float) -> None:
        self._numbers[_MASS] = mass_kg


def _consistent(words: memoryview[int], sequence: int, read: Callable[[], _T]) -> _T:
    """Return a result of `read` that no other process changed meanwhile; see `words[sequence]`."""
    for attempt in range(_TRIES):
        before = words[sequence]
        value = read()
        if not before & 1 and words[sequence] == before:
            break
        if attempt > _SPINS:  # the writer waits for a processor core, perhaps for this one
            time.sleep(_PAUSE_S)
    return value


class PhysicsBoard:
    """A board for n axes in a file, best in /dev/shm; at first with power and released brakes."""

    def __init__(self, path: Path, memory: mmap.mmap, axes: int, lockstep: bool) -> None:
        """Use `create` or `attach` instead of this."""
        self.path = path
        self.axes = axes
        self.lockstep = lockstep
        """Whether a master advances bus time; else it follows the clock."""
        self._memory = memory
        self._owned = False
        self._views: list[memoryview[Any]] = []

    @classmethod
    def create(cls, path: str | Path, axes: int, *, lockstep: bool = False) -> Self:
        """Create the file; `close` removes it. Raises BusSetupError if it cannot be created."""
        if not 1 <= axes <= _MAX_AXES:
            raise ValueError(f"axes = {axes}; allowed: 1 to {_MAX_AXES}")
        path = Path(path)
        if path.exists():
            cls.attach(path).close()  # replace the board of a killed simulator, but no other file
        words = bytearray(8 * _WORDS * (1 + axes))
        _HEADER.pack_into(words, 0, _MAGIC, axes, _WORDS, lockstep)
        for axis in range(axes):
            start = 8 * _WORDS * (1 + axis)
            struct.pack_into("<4d", words, start + 8 * _POWER_FROM, *_ALWAYS, *_ALWAYS)
        try:
            with replacing(path) as file:
                file.write(words)
        except OSError as error:
            raise BusSetupError(f"physics board {path}: {error.strerror}") from None
        board = cls.attach(path)
        board._owned = True
        return board

    @classmethod
    def attach(cls, path: str | Path) -> Self:
        """Open a board that a simulator created. Raises BusSetupError.

        It is also raised on processors that may reorder the stores that another process sees.
        """
        if (machine := platform.machine()) not in _IN_ORDER:
            raise BusSetupError(
                f"{path}: this machine's processor is {machine}; devices can share a physics "
                f"board, which has no lock, only on {', '.join(_IN_ORDER)}"
            )
        path = Path(path)
        try:
            with path.open("r+b") as file:
                memory = mmap.mmap(file.fileno(), 0)
        except (OSError, ValueError) as error:
            reason = error.strerror if isinstance(error, OSError) else "it is empty"
            raise BusSetupError(
                f"physics board {path}: {reason}; `cdpr sim up ... --board {path}` makes it"
            ) from None
        magic, axes, words, lockstep = (
            _HEADER.unpack_from(memory) if len(memory) >= _HEADER.size else (b"", 0, 0, 0)
        )
        if magic != _MAGIC or words != _WORDS or len(memory) != 8 * _WORDS * (1 + axes):
            memory.close()
            raise BusSetupError(f"physics board {path}: the file is not a physics board")
        return cls(path, memory, axes, bool(lockstep))

    def axis(self, number: int) -> BoardAxis:
        """Return one axis, counted from 0; raises IndexError."""
        if not 0 <= number < self.axes:
            raise IndexError(f"physics board {self.path}: axis {number} of {self.axes}")
        start = 8 * _WORDS * (1 + number)
        part = memoryview(self._memory)[start : start + 8 * _WORDS]
        words, numbers = part.cast("Q"), part.cast("d")
        self._views += [words, numbers, part]
        return BoardAxis(words, numbers)

    @property
    def platform(self) -> BoardPlatform:
        """The platform that the axes' cables move."""
        part = memoryview(self._memory)[8 * _PLATFORM : 8 * (_PLATFORM + 1 + _MOTION)]
        words, numbers = part.cast("Q"), part.cast("d")
        self._views += [words, numbers, part]
        return BoardPlatform(words, numbers)

    def close(self) -> None:
        """Close the file, and remove it if it was created here."""
        for view in self._views:
            view.release()
        self._views.clear()
        self._memory.close()
        if self._owned:
            self._owned = False
            self.path.unlink(missing_ok=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def common_time(boards: Sequence[PhysicsBoard]) -> Callable[[], float] | None:
    """Return a function for the bus time of boards in lockstep; None for paced ones.

    Raises BusSetupError if some of them are in lockstep and others are not.
    """
    kinds = {board.lockstep for board in boards}
    if len(kinds) > 1:
        names = ", ".join(str(board.path) for board in boards if board.lockstep)
        raise BusSetupError(
            f"physics boards in lockstep ({names}) and paced ones cannot be combined"
        )
    if kinds != {True}:
        return None
    axes = [board.axis(i) for board in boards for i in range(board.axes)]
    return lambda: max(axis.time_s for axis in axes)
