"""The operator's view in the terminal: the robot in its plane, and the link to it."""

from __future__ import annotations

import math
import time
from typing import Any, Final

from rich.console import Console, ConsoleOptions, RenderResult
from rich.text import Text

from cdpr_rt.core.states import LoopState
from cdpr_tools.client.status_text import slow_text
from cdpr_tools.teleop.session import TeleopSession

_WIDTH, _HEIGHT, _LEAST_HEIGHT = 64, 22, 8
_WRAPPED = 3
"""Number of additional lines for texts that are wider than the terminal."""
_MARGIN_m = 0.1
_SHOWN_TRIPS = 120
_SILENT_S: Final = 0.5
"""Age above which data are stale; longer than any usable round trip."""
_STALE_S: Final = 2.0
_MARKS: Final = {"target": ("+", "bold cyan"), "platform": ("o", "bold green")}

Point = tuple[float, float]


class View:
    """Draws a session on each request.

    `reason` is why the robot was held or stopped before. The view does not show this reason again.
    """

    def __init__(
        self, session: TeleopSession, description: dict[str, Any], reason: str = ""
    ) -> None:
        self._session = session
        platform = description.get("platform") or {}
        self._platform = platform if len(platform.get("home_m", ())) == 2 else None
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

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """Yield the picture, if the plane is known and there is room, and the figures."""
        lines = self._lines()
        height = min(_HEIGHT, console.height - _WRAPPED - len(lines))
        if self._platform is not None and height >= _LEAST_HEIGHT:
            yield self._picture(self._platform, min(_WIDTH, options.max_width), height)
        yield from lines

    def _picture(self, platform: dict[str, Any], width: int, height: int) -> Text:
        session = self._session
        exits = [_point(each) for each in platform["exit_points_m"]]
        low, high = _point(platform["workspace_min_m"]), _point(platform["workspace_max_m"])
        shown = [*exits, low, high]
        canvas = Canvas(
            width,
            height,
            (min(x for x, _ in shown) - _MARGIN_m, min(y for _, y in shown) - _MARGIN_m),
            (max(x for x, _ in shown) + _MARGIN_m, max(y for _, y in shown) + _MARGIN_m),
        )
        canvas.outline([low, (high[0], low[1]), high, (low[0], high[1])])
        x, y = session.pose_m
        if math.isfinite(x):
            (turn,) = session.turn_rad
            anchors = [
                (x + math.cos(turn) * b - math.sin(turn) * c,
                 y + math.sin(turn) * b + math.cos(turn) * c)
                for b, c in map(_point, platform["anchor_points_m"])
            ]  # fmt: skip
            canvas.outline(anchors)
            for exit_point, anchor in zip(exits, anchors, strict=True):
                canvas.line(exit_point, anchor)
        canvas.mark((x, y), *_MARKS["platform"])
        canvas.mark(_point(self._target()), *_MARKS["target"])
        for exit_point in exits:
            canvas.mark(exit_point, "◉", "")
        rows = [
            Text.assemble(*((letters, style or "dim") for letters, style in row))
            for row in canvas.rows()
        ]
        return Text("\n", no_wrap=True).join(rows)

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
        word = "ROBOT HOLDS" if hand.clutch or hand.trouble else "ROBOT FOLLOWS"
        count = f", {hand.confirmed} confirmed" if hand.confirmed else ""
        return Text.assemble(
            (word, "bold yellow" if word == "ROBOT HOLDS" else "bold green"), f"  {state}{count}"
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


def _point(values: Any) -> Point:
    x, y = values[:2]
    return float(x), float(y)


def _mm(place: tuple[float, ...]) -> str:
    return " ".join(f"{1e3 * value:+.1f}" for value in place) + " mm"


def _deg(angles: tuple[float, ...]) -> str:
    return " ".join(f"{math.degrees(angle):+.2f}" for angle in angles)


_DOTS = ((0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80))
_BLANK = 0x2800


class Canvas:
    """`width` times `height` characters that show the plane from `low` to `high`, both (2,) in m.

    x points right, y upward, both at the same scale; the picture is centred.
    """

    def __init__(
        self, width: int, height: int, low: tuple[float, float], high: tuple[float, float]
    ) -> None:
        self._width, self._height = width, height
        columns, rows = 2 * width, 4 * height
        sides = max(high[0] - low[0], 1e-6), max(high[1] - low[1], 1e-6)
        self._per_m = min((columns - 1) / sides[0], (rows - 1) / sides[1])
        self._left = 0.5 * (columns - 1 - self._per_m * sides[0]) - self._per_m * low[0]
        self._top = 0.5 * (rows - 1 + self._per_m * sides[1]) + self._per_m * low[1]
        self._cells = [[0] * width for _ in range(height)]
        self._marks: dict[tuple[int, int], tuple[str, str]] = {}

    def line(self, begin: tuple[float, float], end: tuple[float, float]) -> None:
        """Draw a straight line; omit the parts outside."""
        points = [self._dot(begin), self._dot(end)]
        if not all(math.isfinite(value) for point in points for value in point):
            return
        (x0, y0), (x1, y1) = points
        most = 4.0 * (2 * self._width + 4 * self._height)
        steps = math.ceil(min(max(abs(x1 - x0), abs(y1 - y0), 1.0), most))
        for k in range(steps + 1):
            part = k / steps
            column, row = round(x0 + part * (x1 - x0)), round(y0 + part * (y1 - y0))
            if 0 <= column < 2 * self._width and 0 <= row < 4 * self._height:
                self._cells[row // 4][column // 2] |= _DOTS[row % 4][column % 2]

    def outline(self, points: list[tuple[float, float]]) -> None:
        """Draw a closed line through points."""
        for begin, end in zip(points, [*points[1:], points[0]], strict=True):
            self.line(begin, end)

    def mark(self, at: tuple[float, float], letter: str, style: str) -> None:
        """Put a letter over the present character; omit it if it is outside."""
        x, y = self._dot(at)
        if not (math.isfinite(x) and math.isfinite(y)):
            return
        column, row = math.floor(x / 2.0), math.floor(y / 4.0)
        if 0 <= column < self._width and 0 <= row < self._height:
            self._marks[row, column] = letter, style

    def rows(self) -> list[list[tuple[str, str]]]:
        """Return each row as (characters, style) of its pieces, top first."""
        rows = []
        for row, cells in enumerate(self._cells):
            letters = "".join(chr(_BLANK + dots) if dots else " " for dots in cells)
            pieces, done = [], 0
            for column in sorted(column for at, column in self._marks if at == row):
                pieces += [(letters[done:column], ""), self._marks[row, column]]
                done = column + 1
            rows.append([*pieces, (letters[done:], "")])
        return rows

    def _dot(self, at: tuple[float, float]) -> tuple[float, float]:
        return self._left + self._per_m * at[0], self._top - self._per_m * at[1]
