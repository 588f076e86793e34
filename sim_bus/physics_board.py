"""The physics board: a small shared file through which simulated devices feel each other.

The simulated drives write what really happens to motor and cable; simulated sensors, safety
devices and hands, each in a process of its own, read it and write what they do to the winch.
"""

from __future__ import annotations

import mmap
import os
import struct
import time
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple, Self

from sim_bus.errors import BusSetupError

_HEADER = struct.Struct("<8sII")
_MAGIC = b"cdprPHB1"
_MAX_AXES = 256
# each 8 bytes: the drive's own part first, behind its sequence number, then what others write
_SEQUENCE, _TIME, _TENSION, _ANGLE, _SPEED, _POWER_ON = range(6)
_POWER_ALLOWED, _BRAKE_RELEASED, _MASS = range(6, 9)
_WORDS = 16
_SPINS, _TRIES = 100, 1000
_PAUSE_S = 5e-4


class BoardState(NamedTuple):
    """What a drive last wrote of its axis; all figures belong to one instant."""

    time_s: float
    """Bus time."""
    tension_N: float
    """True tension of the cable, 0 where it is slack."""
    motor_rad: float
    """True mechanical angle of the motor over all turns."""
    motor_rad_s: float
    power_on: bool
    """Whether the power stage is on."""


class BoardAxis:
    """One axis of a board. The drive calls `publish`, everybody may read; the setters are others'.

    Every field has one writer. A read of `state` is consistent: it is repeated while a write is
    under way (a sequence lock; it relies on stores becoming visible in order, as on x86).
    """

    def __init__(self, words: memoryview[int], numbers: memoryview[float]) -> None:
        self._words = words
        self._numbers = numbers

    def publish(
        self,
        time_s: float,
        tension_N: float,
        motor_rad: float,
        motor_rad_s: float,
        power_on: bool,
    ) -> None:
        """Write the state of the axis; for its drive alone."""
        words, numbers = self._words, self._numbers
        # odd while the figures are being changed, also after a writer that died in the middle
        sequence = words[_SEQUENCE] | 1
        words[_SEQUENCE] = sequence
        numbers[_TIME] = time_s
        numbers[_TENSION] = tension_N
        numbers[_ANGLE] = motor_rad
        numbers[_SPEED] = motor_rad_s
        numbers[_POWER_ON] = 1.0 if power_on else 0.0
        words[_SEQUENCE] = (sequence + 1) & 0xFFFFFFFFFFFFFFFF

    def state(self) -> BoardState:
        """Return what the drive last wrote; after a writer that died in the middle, what stands."""
        words, numbers = self._words, self._numbers
        for attempt in range(_TRIES):
            before = words[_SEQUENCE]
            time_s, tension, angle, speed, power = numbers[_TIME : _POWER_ON + 1].tolist()
            if not before & 1 and words[_SEQUENCE] == before:
                break
            if attempt > _SPINS:  # its process waits for a core, perhaps for ours
                time.sleep(_PAUSE_S)
        return BoardState(time_s, tension, angle, speed, power != 0.0)

    @property
    def power_allowed(self) -> bool:
        """Whether the drive may have power; False is a safe torque off."""
        return bool(self._numbers[_POWER_ALLOWED])

    @power_allowed.setter
    def power_allowed(self, allowed: bool) -> None:
        self._numbers[_POWER_ALLOWED] = 1.0 if allowed else 0.0

    @property
    def brake_released(self) -> bool:
        """Whether the rotor is free of its brake."""
        return bool(self._numbers[_BRAKE_RELEASED])

    @brake_released.setter
    def brake_released(self, released: bool) -> None:
        self._numbers[_BRAKE_RELEASED] = 1.0 if released else 0.0

    @property
    def hung_mass_kg(self) -> float:
        """Mass that hangs on the cable, where the plant's load is a hung mass."""
        return float(self._numbers[_MASS])

    @hung_mass_kg.setter
    def hung_mass_kg(self, mass_kg: float) -> None:
        self._numbers[_MASS] = mass_kg


class PhysicsBoard:
    """A board for n axes in a file, best in /dev/shm; power is allowed and brakes are released."""

    def __init__(self, path: Path, memory: mmap.mmap, axes: int, owned: bool) -> None:
        """Use `create` or `attach`."""
        self.path = path
        self.axes = axes
        self._memory = memory
        self._owned = owned
        self._views: list[memoryview[Any]] = []

    @classmethod
    def create(cls, path: str | Path, axes: int) -> Self:
        """Make the file anew; `close` removes it. Raises BusSetupError where it cannot be made."""
        if not 1 <= axes <= _MAX_AXES:
            raise ValueError(f"axes = {axes}; allowed: 1 to {_MAX_AXES}")
        path = Path(path)
        if path.exists():
            cls.attach(path).close()  # one that a killed simulator left is replaced, no other file
        fresh = path.with_name(f".{path.name}.{os.getpid()}")
        words = bytearray(8 * _WORDS * (1 + axes))
        _HEADER.pack_into(words, 0, _MAGIC, axes, _WORDS)
        for axis in range(axes):
            start = 8 * _WORDS * (1 + axis)
            struct.pack_into("<2d", words, start + 8 * _POWER_ALLOWED, 1.0, 1.0)
        try:
            fresh.write_bytes(words)
            fresh.replace(path)
        except OSError as error:
            with suppress(OSError):
                fresh.unlink()
            raise BusSetupError(f"physics board {path}: {error.strerror}") from None
        board = cls.attach(path)
        board._owned = True
        return board

    @classmethod
    def attach(cls, path: str | Path) -> Self:
        """Open a board that a simulator made. Raises BusSetupError."""
        path = Path(path)
        try:
            with path.open("r+b") as file:
                memory = mmap.mmap(file.fileno(), 0)
        except (OSError, ValueError) as error:
            reason = error.strerror if isinstance(error, OSError) else "it is empty"
            raise BusSetupError(
                f"physics board {path}: {reason}; `cdpr sim up ... --board {path}` makes it"
            ) from None
        magic, axes, words = (
            _HEADER.unpack_from(memory) if len(memory) >= _HEADER.size else (b"", 0, 0)
        )
        if magic != _MAGIC or words != _WORDS or len(memory) != 8 * _WORDS * (1 + axes):
            memory.close()
            raise BusSetupError(f"physics board {path}: the file is not a physics board")
        return cls(path, memory, axes, owned=False)

    def axis(self, number: int) -> BoardAxis:
        """Return one axis, counted from 0; raises IndexError."""
        if not 0 <= number < self.axes:
            raise IndexError(f"physics board {self.path}: axis {number} of {self.axes}")
        start = 8 * _WORDS * (1 + number)
        part = memoryview(self._memory)[start : start + 8 * _WORDS]
        words, numbers = part.cast("Q"), part.cast("d")
        self._views += [words, numbers, part]
        return BoardAxis(words, numbers)

    def close(self) -> None:
        """Let go of the file, and remove it where it was made here."""
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
