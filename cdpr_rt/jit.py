"""Compile the numeric kernels of the cycle to machine code."""

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

_F = TypeVar("_F", bound=Callable[..., Any])


def jit(function: _F) -> _F:
    """Return `function` compiled by numba, cached on disk, with its type kept for the checker.

    It may call only kernels of its own file: the cache sees no change in another one.
    """
    return cast(_F, numba.njit(cache=True)(function))
