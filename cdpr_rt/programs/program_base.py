"""Base classes of programs."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from cdpr_rt.arrays import FloatArray
from cdpr_rt.programs.arguments import CommandArguments
from cdpr_rt.programs.base import REST_S, ProgramError


class ProgramDefaults:
    """Defaults of a program without arguments, platform and stream."""

    name: str

    def preparation(self, _arguments: Mapping[str, Any]) -> Callable[[], None] | None:
        """Return None: commands need nothing to be done before."""
        return None

    def check(self, arguments: Mapping[str, Any]) -> Any:
        """Raise ProgramError for any argument."""
        CommandArguments(self.name, arguments, ())

    def apply(self, checked: Any) -> None:
        """Change nothing."""

    def command(self, arguments: Mapping[str, Any]) -> None:
        """Check a command and apply it; raises ProgramError where `check` does."""
        self.apply(self.check(arguments))

    @property
    def rest_s(self) -> float:
        """Return the longest that it takes until it is at rest after a stop."""
        return REST_S

    @property
    def pose(self) -> FloatArray | None:
        """Return None: there is no platform."""
        return None

    @property
    def pose_setpoint(self) -> FloatArray | None:
        """Return None: there is no platform."""
        return None

    @property
    def stream_age_s(self) -> float:
        """Return the age of the newest sample that it follows, nan where it follows none."""
        return math.nan

    @property
    def stream_buttons(self) -> int:
        """Return the buttons of the sample that it plays, 0 where it follows none."""
        return 0

    def progress(self) -> dict[str, Any]:
        """Return nothing, where a program has no end."""
        return {}


class CommandedProgram(ProgramDefaults):
    """Base class of programs that take commands while they run, and brake on `stop`.

    Subclasses override `_parsed` and `_take`.
    """

    _stopping = False
    _at_rest = True

    def check(self, arguments: Mapping[str, Any]) -> Any:
        """Return what `apply` takes; raises ProgramError for what is refused."""
        return self._parsed(arguments)

    def apply(self, checked: Any) -> None:
        """Apply a command that has been checked."""
        self._at_rest = False
        self._take(checked)

    def command(self, arguments: Mapping[str, Any]) -> None:
        """Check a command and apply it; raises ProgramError and changes nothing then."""
        checked = self.check(arguments)
        if self._stopping:
            raise ProgramError(f"{self.name}: it is being stopped; start it anew")
        self.apply(checked)

    def stop(self) -> None:
        """Begin to brake to a standstill."""
        self._stopping = True
        self._at_rest = False

    @property
    def at_rest(self) -> bool:
        """Whether the set-point stands still and nothing is left to do."""
        return self._at_rest

    def _parsed(self, arguments: Mapping[str, Any]) -> Any:
        """Return what `_take` takes; raises ProgramError."""
        return CommandArguments(self.name, arguments, ())

    def _take(self, _parsed: Any) -> None:
        """Apply a command's parsed arguments."""
