"""The loop's state, the reason for the last change, and the transitions that are allowed."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

from cdpr_rt.core.states import ALLOWED, LoopState, Transition
from cdpr_rt.errors import ControlError
from cdpr_rt.refusal import CommandRefusal, RefusalCode

_MOST_CHARACTERS = 2000


class RefusedError(ControlError):
    """A command was refused for the reason given; nothing has changed."""


class Lifecycle:
    """The state, and the fault reason, which stays until acknowledged or a new motion."""

    def __init__(self) -> None:
        self.state = LoopState.UNCONFIGURED
        self.since_ns = time.monotonic_ns()
        self.reason = ""
        self.details: Mapping[str, Any] | None = None
        """The exceeded limit by name and value, None where there is none."""
        self.changed = True
        """Whether the status must be published again."""

    def require(self, transition: Transition) -> None:
        """Raise RefusedError where `transition` is not allowed in the present state."""
        allowed = ALLOWED[transition]
        if self.state not in allowed:
            raise self.not_in_state(transition.name.lower(), *allowed)

    def not_in_state(self, command: str, *allowed: LoopState) -> RefusedError:
        """Return the refusal of a command that is only allowed in other states."""
        states = {"state": self.state.label, "allowed": [state.label for state in allowed]}
        return RefusedError(CommandRefusal(RefusalCode.NOT_IN_STATE, command, arguments=states))

    def enter(self, state: LoopState) -> None:
        """Go to `state`."""
        if state is not self.state:
            self.state = state
            self.since_ns = time.monotonic_ns()
            self.changed = True

    def set_reason(self, reason: str, details: Mapping[str, Any] | None = None) -> None:
        """Set why the motion ended or was held."""
        self.reason = reason[:_MOST_CHARACTERS]
        self.details = details
        self.changed = True

    def clear_reason(self) -> None:
        """Clear the reason."""
        self.set_reason("")
