"""What loading every profile takes, against its bound and against bare TOML parsing."""

from __future__ import annotations

import time
import tomllib
from pathlib import Path
from typing import Any

import cdpr_profiles

BOUND_MS = 100.0


def measure(repeats: int) -> dict[str, Any]:
    """Return the best of `repeats` wall times of both, in ms, and their ratio."""
    files = sorted(Path(cdpr_profiles.__file__).parent.glob("*/*.toml"))
    load_ms = round(1e3 * min(_load_s() for _ in range(repeats)), 2)
    parse_ms = round(1e3 * min(_parse_s(files) for _ in range(repeats)), 2)
    return {
        "files": len(files),
        "load_all_ms": load_ms,
        "tomllib_ms": parse_ms,
        "ratio": round(load_ms / parse_ms, 2),
        "bound_ms": BOUND_MS,
        "reached": load_ms < BOUND_MS,
    }


def _load_s() -> float:
    start = time.perf_counter()
    cdpr_profiles.load_all()
    return time.perf_counter() - start


def _parse_s(files: list[Path]) -> float:
    start = time.perf_counter()
    for file in files:
        with file.open("rb") as stream:
            tomllib.load(stream)
    return time.perf_counter() - start
