"""Where the loop stands, why it left where it was, and what may be asked of it there."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

from cdpr_rt.errors import ControlError
from cdpr_rt.runtime.states import ALLOWED, LoopState, Transition

_MOST_CHARACTERS = 2000


class RefusedError(ControlError):
    """What was asked for is not done, for the reason given; nothing has changed."""


class Lifecycle:
    """The state, and the reason, which stays until it is acknowledged or something new is done."""

    def __init__(self) -> None:
        self.state = LoopState.UNCONFIGURED
        self.since_ns = time.monotonic_ns()
        self.reason = ""
        self.details: Mapping[str, Any] | None = None
        """The limit that was exceeded, by name and value, None where it was none."""

    def require(self, transition: Transition) -> None:
        """Raise RefusedError where `transition` is not allowed in the present state."""
        allowed = ALLOWED[transition]
        if self.state not in allowed:
            states = " or ".join(state.label for state in allowed)
            raise RefusedError(
                f"{transition.name.lower()}: not in state {self.state.label}; allowed in {states}"
            )

    def enter(self, state: LoopState) -> None:
        """Go to `state`."""
        if state is not self.state:
            self.state = state
            self.since_ns = time.monotonic_ns()

    def blame(self, reason: str, details: Mapping[str, Any] | None = None) -> None:
        """Keep why the motion ended or was held."""
        self.reason = reason[:_MOST_CHARACTERS]
        self.details = details

    def forget(self) -> None:
        """Forget the reason."""
        self.blame("")
