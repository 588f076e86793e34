"""The operator's view in the terminal: the robot's position, its target, and the link to it."""

from __future__ import annotations

import math
import time
from typing import Any, Final

from rich.text import Text

from cdpr_rt.core.states import LoopState
from cdpr_tools.client.status_text import slow_text
from cdpr_tools.teleop.session import TeleopSession

_SHOWN_TRIPS = 120
_SILENT_S: Final = 0.5
"""Age above which data are stale; longer than any usable round trip."""
_STALE_S: Final = 2.0


class View:
    """Shows a session on each request.

    `reason` is why the robot was held or stopped before; it is not shown again.
    """

    def __init__(
        self, session: TeleopSession, description: dict[str, Any], reason: str = ""
    ) -> None:
        self._session = session
        self._axes = [str(axis.get("name")) for axis in description.get("axes", [])]
        self._reason = reason
        self._last_status: tuple[float, dict[str, Any]] = -math.inf, {}
        self.held_back = ""
        """The last reason why the robot did not follow the hand."""

    def tell(self, status: dict[str, Any]) -> None:
        """Show the daemon's status until it is too old."""
        self._last_status = time.monotonic(), status
        self.held_back = (status.get("program_progress") or {}).get("held_back") or self.held_back

    @property
    def _status(self) -> dict[str, Any]:
        received_s, status = self._last_status
        return status if time.monotonic() - received_s < _STALE_S else {}

    def __rich__(self) -> Text:
        """Return the lines of the present view."""
        return Text("\n").join(self._lines())

    def _target(self) -> tuple[float, ...]:
        target_m = self._status.get("program_progress", {}).get("target_m")
        return self._session.setpoint_m if target_m is None else tuple(map(float, target_m))

    def _lines(self) -> list[Text]:
        session, hand = self._session, self._session.hand
        lines = [self._state()]
        if math.isfinite(session.pose_m[0]):
            lines.append(
                Text(
                    f"platform {_mm(session.pose_m)}, {_deg(session.turn_rad)} deg; "
                    f"target {_mm(self._target())}"
                )
            )
        place = _mm(hand.position_m[: session.coordinates])
        lines.append(Text(f"hand {place} times {session.scale:g}; {self._link()}"))
        tensions = [axis.get("tension_N") for axis in self._status.get("axes", [])]
        if any(value is not None for value in tensions):
            named = zip(self._axes, tensions, strict=False)
            texts = [f"{name} {'-' if t is None else f'{t:.0f}'}" for name, t in named]
            lines.append(Text(f"tensions in N: {', '.join(texts)}"))
        refused = self._status.get("program_progress", {}).get("held_back")
        slow = slow_text(self._status)
        for text in (hand.trouble, refused, self._status.get("reason"), slow):
            if text and text != self._reason:
                lines.append(Text(str(text), style="yellow"))
        lines.append(Text(session.device.hint, style="dim"))
        return lines

    def _state(self) -> Text:
        session, hand = self._session, self._session.hand
        answer = session.answer
        state = "no answer yet" if answer is None else LoopState(answer.state).label
        if not session.leading:
            return Text(f"waiting for the robot to follow: {state}", style="yellow")
        if session.silent_s > _SILENT_S:
            return Text(f"NO ANSWER for {session.silent_s:.1f} s", style="bold red")
        leads = "HOLDS" if hand.clutch or hand.trouble else "LEADS"
        count = f", {hand.confirmed} confirmed" if hand.confirmed else ""
        return Text.assemble(
            (leads, "bold yellow" if leads == "HOLDS" else "bold green"), f"  {state}{count}"
        )

    def _link(self) -> str:
        session = self._session
        recent = list(session.round_trips_s)[-_SHOWN_TRIPS:]
        if not recent:
            return "no answer yet"
        missing = max(session.stream.sent - session.stream.answered, 0)
        share = 100.0 * missing / max(session.stream.sent, 1)
        stream = self._status.get("program_progress", {}).get("stream", "")
        return (
            f"round trip {1e3 * recent[-1]:.1f} ms (at most {1e3 * max(recent):.1f} in 2 s), "
            f"{share:.0f} % unanswered{f', stream {stream}' if stream else ''}"
        )


def _mm(place: tuple[float, ...]) -> str:
    return " ".join(f"{1e3 * value:+.1f}" for value in place) + " mm"


def _deg(angles: tuple[float, ...]) -> str:
    return " ".join(f"{math.degrees(angle):+.2f}" for angle in angles)
