"""Byte channel to a Modbus device, awaited by the robot's clock, without a thread."""

from __future__ import annotations

import math
import os
import select
from collections.abc import Callable
from typing import Final

from cdpr_rt.core.clock import Clock

_CHUNK: Final = 4096
_END_OF_ANSWER: Final = bytes.fromhex("0000 ffff 0002 0000")
_DEAD_PEER_S: Final = 30.0


class ByteChannel:
    """Requests and answers through a descriptor; a source of the clock.

    In lockstep bus time stands still until the answer has come, however long the device's process
    is held up; it marks an answer that is missing or cut off (docs/wire.md).
    """

    def __init__(self, clock: Clock, descriptor: int) -> None:
        os.set_blocking(descriptor, False)
        self._clock = clock
        self._descriptor = descriptor
        self._received = b""
        self.lost = False
        """Whether the other end is gone."""
        clock.add(self)

    def ask(self, question: bytes, is_whole: Callable[[bytes], bool], timeout_s: float) -> bytes:
        """Return what comes after `question`, until it is whole or time is up."""
        self.poll()
        self._received = b""  # what came too late for the question before
        try:
            if os.write(self._descriptor, question) < len(question):
                self._lose()
        except OSError:
            self._lose()

        def ended() -> bool:
            data = self._received
            return self.lost or is_whole(data) or data.endswith(_END_OF_ANSWER)

        clock = self._clock
        asked_s = clock.now_s
        if clock.lockstep:
            self._await_in_lockstep(ended)
        else:
            clock.wait(ended, asked_s + timeout_s)
        answer = self._received.removesuffix(_END_OF_ANSWER)
        if not self.lost and not is_whole(answer):
            clock.wait(None, asked_s + timeout_s)
        return answer

    def _await_in_lockstep(self, ended: Callable[[], bool]) -> None:
        """Read what comes while bus time stands still; a device without any answer is dead."""
        waiting = select.poll()
        waiting.register(self._descriptor, select.POLLIN)
        while not ended() and waiting.poll(1e3 * _DEAD_PEER_S):
            self.poll()

    def close(self) -> None:
        """Remove it from the clock; the descriptor stays open for its owner."""
        self._clock.remove(self)

    def _lose(self) -> None:
        self.lost = True
        self.close()

    # -- as a source of the clock

    def fileno(self) -> int:
        """Return the descriptor."""
        return self._descriptor

    def poll(self) -> bool:
        """Read what has come."""
        if self.lost:
            return False
        try:
            data = os.read(self._descriptor, _CHUNK)
        except BlockingIOError:
            return False
        except OSError:
            data = b""
        if data:
            self._received += data
        else:
            self._lose()
        return True

    def tick(self, now_s: float) -> float:  # noqa: ARG002  # nothing is due by itself
        """Return that nothing is ever due."""
        return math.inf
