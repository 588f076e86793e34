"""What loading every profile takes, against its bound and against bare TOML parsing."""

from __future__ import annotations

import time
import tomllib
from pathlib import Path
from typing import Any

import cdpr_profiles
from cdpr_tools.bench.timing import verdict
from cdpr_tools.output import Output

BOUND_MS = 100.0


def measure(repeats: int, out: Output) -> dict[str, Any]:  # noqa: ARG001  # as all have it
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


def report(figures: dict[str, Any]) -> list[str]:
    """Return the figures as lines."""
    return [
        f"all {figures['files']} profile files: {figures['load_all_ms']:.1f} ms loaded and "
        f"validated, {figures['tomllib_ms']:.1f} ms with tomllib alone, "
        f"ratio {figures['ratio']:.2f}",
        f"wanted below {figures['bound_ms']:g} ms: {verdict(figures['reached'])}",
    ]


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
