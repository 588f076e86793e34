"""The ready line of a simulator: JSON for programs, a few lines on a terminal."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from typing import Any

_SHOWN_KEYS = ("robot", "bus", "mode", "nodes", "slcan", "socketcand", "truth_log")


def print_ready(ready: dict[str, Any]) -> None:
    """Print {"ready": ...} as one line of JSON, or a readable text on a terminal."""
    if not sys.stdout.isatty():
        print(json.dumps({"ready": ready}), flush=True)
        return
    for line in _lines(ready):
        print(line)
    print("up; Ctrl-C ends it", flush=True)


def _lines(ready: dict[str, Any]) -> Iterator[str]:
    for key in _SHOWN_KEYS:
        value = ready.get(key)
        if value is not None:
            shown = ", ".join(map(str, value)) if isinstance(value, list) else value
            yield f"{key.replace('_', ' '):12}{shown}"
    buses = ready.get("buses")
    for bus in buses.values() if isinstance(buses, dict) else ():
        yield from _lines(bus)
