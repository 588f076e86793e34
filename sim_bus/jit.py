"""Compile the numeric kernels of the simulation to machine code."""

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from numba.core import config

_SETTINGS: Any = config
_F = TypeVar("_F", bound=Callable[..., Any])


def _kernel_cache() -> str:
    """Return a cache directory that belongs to this state of the kernels' sources.

    numba looks only at the file of the function it compiles, not at those of the functions that
    one calls, and would go on using machine code of an older callee.
    """
    here = Path(__file__).parent
    digest = hashlib.sha256()
    for source in sorted(here.glob("*.py")):
        text = source.read_bytes()
        if b"from sim_bus.jit import" in text:
            digest.update(text)
    base = Path(_SETTINGS.CACHE_DIR or here / "__pycache__")
    return str(base / f"kernels-{digest.hexdigest()[:12]}")


_CACHE = _kernel_cache()


def jit(function: _F) -> _F:
    """Return `function` compiled by numba, cached on disk, with its type kept for the checker."""
    elsewhere = _SETTINGS.CACHE_DIR
    _SETTINGS.CACHE_DIR = _CACHE
    try:
        return cast(_F, numba.njit(cache=True)(function))
    finally:
        _SETTINGS.CACHE_DIR = elsewhere
