"""Lead a robot with the keys of a terminal: each press, and each repeat, is one step."""

from __future__ import annotations

import errno
import math
import os
import re
import select
import termios
import tty
from typing import Final

from cdpr_tools.errors import BadInputError
from cdpr_tools.teleop.input_device import (
    Directions,
    End,
    Hand,
    InputSample,
    TURN_RAD_PER_m,
    Vector,
)

STEPS_mm: Final = (0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0)
_FIRST_STEP: Final = STEPS_mm.index(0.5)
_FASTEST_Hz: Final = 60.0
_LONGEST_S: Final = 0.1
_READ_BYTES: Final = 4096
_MOVES: Final[dict[str, Vector]] = {
    "A": (0, 1, 0), "B": (0, -1, 0), "C": (1, 0, 0), "D": (-1, 0, 0),
    "w": (0, 1, 0), "s": (0, -1, 0), "d": (1, 0, 0), "a": (-1, 0, 0),
    "r": (0, 0, 1), "f": (0, 0, -1),
}  # fmt: skip
_TURNS: Final[dict[str, Vector]] = {
    "k": (1, 0, 0), "i": (-1, 0, 0), "l": (0, 1, 0), "j": (0, -1, 0), "u": (0, 0, 1),
    "o": (0, 0, -1),
}  # fmt: skip
_KEYS_ABOUT: Final = ("k i", "l j", "u o")
_KEY = re.compile(r"\x1b[\[O]([A-D])|\x1b\[[0-9;]*[~A-Za-z]|\x1bO.|\x1b|([^\x1b])", re.DOTALL)
_UNFINISHED = re.compile(r"\x1b(\[[0-9;]*|O)?$")


class Keys(Hand):
    """Effect of keys on a hand; knows characters, but no terminal.

    The hand moves only when keys arrive: it stops if the user releases them or is gone.
    """

    def __init__(self, scale: float) -> None:
        super().__init__(scale)
        self._step = _FIRST_STEP
        self._left = ""
        self.clutch = False
        self.confirmed = 0
        self.quit = False

    @property
    def step_m(self) -> float:
        """Return the motion of the hand for one press."""
        return STEPS_mm[self._step] * 1e-3

    def press(self, text: str, passed_s: float) -> None:
        """Process the characters that arrived within the last `passed_s`.

        Only as many steps count as a held key can repeat in that time, or in `_LONGEST_S` if that
        is shorter. Any others were pasted, or typed before the program listened.
        """
        most = 1 + int(_FASTEST_Hz * min(passed_s, _LONGEST_S))
        text = self._left + text
        unfinished = _UNFINISHED.search(text)
        self._left = unfinished.group() if unfinished else ""
        steps = 0
        for key in _KEY.finditer(text[: len(text) - len(self._left)]):
            name = key.group(1) or key.group(2)
            if name in _MOVES or name in _TURNS:
                steps += 1
                if steps <= most and not self.clutch:
                    self._make_step(name)
            elif name is not None:
                self._command(name)

    def _make_step(self, key: str) -> None:
        if key in _MOVES:
            x, y, z = (self.step_m * way for way in _MOVES[key])
            self.move((x, y, z))
        else:
            x, y, z = (TURN_RAD_PER_m * self.step_m * way for way in _TURNS[key])
            self.turn((x, y, z))

    def reset(self) -> None:
        """Undo the effect of all keys so far, except a request to end."""
        self.go_back()
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
    """The terminal of a descriptor, without echo and without waiting for whole lines.

    Ctrl-C and Ctrl-Z keep their effect. Raises BadInputError if there is no terminal.
    """

    def __init__(self, scale: float, fd: int = 0, directions: Directions = (2, ())) -> None:
        self._fd = fd
        self._more = "; r f: up, down" if directions[0] > 2 else ""
        if about := directions[1]:
            keys = " ".join(_KEYS_ABOUT[axis] for axis in about)
            self._more += f"; {keys}: turn"
        self._keys = Keys(scale)
        self._gone = ""
        self._read_s = math.nan
        try:
            self._before = termios.tcgetattr(fd)
            tty.setcbreak(fd, termios.TCSANOW)
            termios.tcflush(fd, termios.TCIFLUSH)  # earlier input must not move the robot
        except (termios.error, OSError) as error:
            raise BadInputError(
                f"--device keyboard: standard input is not a terminal ({error.args[-1]})"
            ) from None

    @property
    def hint(self) -> str:
        """Return a line on what each key does."""
        return (
            f"arrows or wasd: {self._keys.step_m * 1e3:g} mm step of the hand, hold the key "
            "to continue"
            f"{self._more}; + and -: longer, shorter steps; space: clutch; Enter: confirm; q: end"
        )

    def read(self, now_s: float) -> InputSample:
        """Return the present sample; it reports the end if the terminal was closed.

        Keys typed before the first call have no effect.
        """
        keys, first = self._keys, math.isnan(self._read_s)
        passed_s, self._read_s = (0.0 if first else now_s - self._read_s), now_s
        if not self._gone:
            self._take(passed_s)
        if first:
            keys.reset()
        end = End("ended by key q") if keys.quit else None
        if self._gone:
            end = End(self._gone, failed=True)
        return InputSample(keys.position_m, keys.quaternion, keys.clutch, keys.confirmed, end=end)

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
            self._gone = "the terminal was closed"

    def close(self) -> None:
        """Restore the terminal's settings."""
        try:
            termios.tcsetattr(self._fd, termios.TCSAFLUSH, self._before)
        except (termios.error, OSError):
            return  # it is gone
