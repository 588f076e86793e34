"""Leading by the keys of a terminal: each press, and each repeat of a key held, is one step."""

from __future__ import annotations

import errno
import math
import os
import re
import select
import termios
import tty
from typing import Final

from tools.errors import BadInputError
from tools.teleop.hand import End, Hand, LimitedHand

STEPS_mm: Final = (0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0)
_FIRST_STEP: Final = STEPS_mm.index(0.5)
_FASTEST_Hz: Final = 60.0
_LONGEST_S: Final = 0.1
_READ_BYTES: Final = 4096
_DIRECTIONS: Final = {
    "A": (0, 1), "B": (0, -1), "C": (1, 0), "D": (-1, 0),
    "w": (0, 1), "s": (0, -1), "d": (1, 0), "a": (-1, 0),
}  # fmt: skip
_KEY = re.compile(r"\x1b[\[O]([A-D])|\x1b\[[0-9;]*[~A-Za-z]|\x1bO.|\x1b|([^\x1b])", re.DOTALL)
_UNFINISHED = re.compile(r"\x1b(\[[0-9;]*|O)?$")


class Keys:
    """What keys do to a hand; knows characters, but no terminal.

    There is no motion without keys that come: who lets go, or is gone, stops the hand.
    """

    def __init__(self, scale: float) -> None:
        self._scale = scale
        self._hand = LimitedHand(scale)
        self._step = _FIRST_STEP
        self._left = ""
        self.clutch = False
        self.confirmed = 0
        self.quit = False

    @property
    def step_m(self) -> float:
        """Return how far one press moves the hand."""
        return STEPS_mm[self._step] * 1e-3

    @property
    def position_m(self) -> tuple[float, float]:
        """Return where the hand is."""
        return self._hand.position_m

    def press(self, text: str, passed_s: float) -> None:
        """Take the characters that came within the last `passed_s`.

        Of more steps than keys repeat in that time, and of those that had to wait for long, only
        the first few count: they were pasted, or typed while nobody listened.
        """
        most = 1 + int(_FASTEST_Hz * min(passed_s, _LONGEST_S))
        text = self._left + text
        unfinished = _UNFINISHED.search(text)
        self._left = unfinished.group() if unfinished else ""
        steps = 0
        for key in _KEY.finditer(text[: len(text) - len(self._left)]):
            name = key.group(1) or key.group(2)
            if name in _DIRECTIONS:
                steps += 1
                if steps <= most and not self.clutch:
                    x, y = _DIRECTIONS[name]
                    self._hand.move(x * self.step_m, y * self.step_m)
            elif name is not None:
                self._command(name)

    def disregard(self) -> None:
        """Take back what keys have done so far, but for the wish to end."""
        self._hand = LimitedHand(self._scale)
        self._step = _FIRST_STEP
        self.clutch = False
        self.confirmed = 0

    def _command(self, key: str) -> None:
        if key == " ":
            self.clutch = not self.clutch
        elif key in "\r\n":
            self.confirmed += 1
        elif key in "+=":
            self._step = min(self._step + 1, len(STEPS_mm) - 1)
        elif key in "-_":
            self._step = max(self._step - 1, 0)
        elif key in "qQ":
            self.quit = True


class Keyboard:
    """The terminal behind a descriptor, without echo and without waiting for whole lines.

    Ctrl-C and Ctrl-Z stay what they are. Raises BadInputError where there is no terminal.
    """

    def __init__(self, scale: float, fd: int = 0) -> None:
        self._fd = fd
        self._keys = Keys(scale)
        self._gone = ""
        self._read_s = math.nan
        try:
            self._before = termios.tcgetattr(fd)
            tty.setcbreak(fd, termios.TCSANOW)
            termios.tcflush(fd, termios.TCIFLUSH)  # what was typed before leads nobody
        except (termios.error, OSError) as error:
            raise BadInputError(
                f"--device keyboard: standard input is no terminal ({error.args[-1]})"
            ) from None

    @property
    def hint(self) -> str:
        """Say which keys do what."""
        return (
            f"arrows or wasd: {self._keys.step_m * 1e3:g} mm of the hand, held to go on; + and -: "
            "longer, shorter; space: hold; Enter: confirm; q: end"
        )

    def read(self, now_s: float) -> Hand:
        """Return where the hand is; it has ended where the terminal is gone.

        What was typed before it is first asked has led nobody, and does not afterwards.
        """
        keys, first = self._keys, math.isnan(self._read_s)
        passed_s, self._read_s = (0.0 if first else now_s - self._read_s), now_s
        if not self._gone:
            self._take(passed_s)
        if first:
            keys.disregard()
        end = End("ended by key q") if keys.quit else None
        if self._gone:
            end = End(self._gone, failed=True)
        return Hand(keys.position_m, keys.clutch, keys.confirmed, end=end)

    def _take(self, passed_s: float) -> None:
        poll = select.poll()
        poll.register(self._fd, select.POLLIN)
        events = poll.poll(0)
        if not events:
            return
        try:
            data = os.read(self._fd, _READ_BYTES)
        except OSError as error:
            if error.errno in (errno.EAGAIN, errno.EINTR):
                return
            data = b""
        if data:
            self._keys.press(data.decode("utf-8", "ignore"), passed_s)
        else:
            self._gone = "the terminal is gone"

    def close(self) -> None:
        """Give the terminal back as it was."""
        try:
            termios.tcsetattr(self._fd, termios.TCSAFLUSH, self._before)
        except (termios.error, OSError):
            return  # it is gone
