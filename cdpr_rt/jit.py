"""Compile the numeric kernels of the cycle to machine code."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, TypeVarTuple, cast

from numba.core import cgutils, types
from numba.extending import intrinsic

from cdpr_profiles.jit import bound, jit

__all__ = ["bound", "bound_to", "copy_bytes", "jit", "jit_inlined", "jit_unlocked"]

_F = TypeVar("_F", bound=Callable[..., Any])
_Objects = TypeVarTuple("_Objects")


def machine_code_folder() -> Path | None:
    """Return the folder with the compiled kernels of this machine, or None if there is no cache."""
    kernel: Any = jit(lambda: None)
    kept = kernel.stats.cache_path
    return None if kept is None else Path(kept)


def jit_inlined(function: _F) -> _F:
    """Return `function` compiled as by `jit` and inlined into each kernel that calls it.

    Use it for functions that take less time than the call itself, which passes nine numbers per
    array.
    """
    return jit(function, forceinline=True)


def jit_unlocked(function: _F) -> _F:
    """Return `function` compiled as by `jit`, without the GIL: other threads run while it waits."""
    return jit(function, nogil=True)


def bound_to(bind: Callable[[*_Objects], _F]) -> Callable[[*_Objects], _F]:
    """Return a function that calls `bind` again only if one of its arguments is a different object.

    If all arguments are the same objects as in the last call, it returns the last result. Use it
    for kernels `bound` to the arrays of up to four objects that rarely change between cycles.
    """
    # four names are faster than a tuple; this function is called several times a cycle
    last_a: Any = None
    last_b: Any = None
    last_c: Any = None
    last_d: Any = None
    kernel: Any = None

    def current(a: Any, b: Any = None, c: Any = None, d: Any = None) -> _F:
        nonlocal last_a, last_b, last_c, last_d, kernel
        if a is not last_a or b is not last_b or c is not last_c or d is not last_d:
            kernel = bind(*(one for one in (a, b, c, d) if one is not None))
            last_a, last_b, last_c, last_d = a, b, c, d
        return kernel  # type: ignore[no-any-return]

    return cast(Callable[[*_Objects], _F], current)


@cast(Callable[[Callable[..., Any]], Callable[[int, int, int], None]], intrinsic)
def copy_bytes(_typing: Any, to: Any, source: Any, size: Any) -> Any:
    """In a kernel, copy `size` bytes from the address `source` to the address `to`."""

    def generate(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        there, here = (builder.inttoptr(address, cgutils.voidptr_t) for address in arguments[:2])
        memcpy: Callable[..., None] = cgutils.raw_memcpy
        memcpy(builder, there, here, arguments[2], 1)

    return types.void(to, source, size), generate
