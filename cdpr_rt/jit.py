"""Compile the numeric kernels of the cycle to machine code."""

import hashlib
import importlib
import logging
import sys
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from typing import Any, TypeVar, TypeVarTuple, cast

import numba
from numba.core import cgutils, config, event, types
from numba.extending import intrinsic
from typing_extensions import override

COMPILING = logging.getLogger("cdpr.compiling")
"""Logger, at level INFO, of each kernel of which no machine code is cached on this machine."""

_SETTINGS: Any = config
_NJIT: Any = numba.njit  # whose types do not know all of its options
_T = TypeVar("_T")
_F = TypeVar("_F", bound=Callable[..., Any])
_Objects = TypeVarTuple("_Objects")


def _skip_blas() -> None:
    """Have numba load what it knows of arrays without scipy.linalg, 0.2 s of each process's start.

    It looks for scipy's BLAS to know whether kernels may call np.cov and np.corrcoef. Others of
    its functions of linear algebra look for it when they are compiled.
    """
    blas = "scipy.linalg.cython_blas"
    if blas not in sys.modules:
        sys.modules[blas] = cast(Any, None)  # makes its import fail
        try:
            importlib.import_module("numba.np.arraymath")
        finally:
            del sys.modules[blas]


_skip_blas()


class _CompileListener(event.Listener):
    """Logs kernels that are compiled because no machine code is cached."""

    @override
    def on_start(self, event: Any) -> None:
        if event.data["dispatcher"].stats.cache_path is not None:
            COMPILING.info("%s", event.data["dispatcher"].__name__)

    @override
    def on_end(self, event: Any) -> None:
        """Nobody waits for it."""


_listen: Callable[[str, event.Listener], None] = event.register
_listen("numba:compile", _CompileListener())


def _call_template(dispatcher: Any, args: Any, kws: Any) -> Any:
    """Have `dispatcher` compile one machine code for a number, be it constant or not."""
    general: Callable[[Any], Any] = types.unliteral
    template: Callable[..., Any] = type(dispatcher).get_call_template
    return template(
        dispatcher, tuple(map(general, args)), {key: general(value) for key, value in kws.items()}
    )


@cache
def _kernel_cache(folder: Path, folders: frozenset[Path]) -> str:
    """Return a cache directory of `folder` for this state of the kernels' sources in `folders`.

    numba looks only at the file of the function it compiles, not at those of the functions that
    one calls, and would go on using machine code of an older callee.
    """
    digest = hashlib.sha256()
    for source in sorted(source for one in folders for source in one.glob("*.py")):
        text = source.read_bytes()
        if b"from cdpr_rt.jit import" in text:
            digest.update(text)
    base = Path(_SETTINGS.CACHE_DIR or folder / "__pycache__")
    return str(base / f"kernels-{digest.hexdigest()[:12]}")


def jit(function: _F, *, nogil: bool = False, forceinline: bool = False) -> _F:
    """Return `function` compiled by numba, cached on disk, with its type kept for the checker.

    It may call kernels of its own folder and those that its module imports from others: machine
    code that is kept belongs to the state of all of these.
    """
    # by whichever of the paths that lead to it: numba keeps machine code for each by itself
    source = Path(function.__code__.co_filename).resolve()
    function.__code__ = function.__code__.replace(co_filename=str(source))
    folder = source.parent
    called: Any = function.__globals__
    folders = frozenset({folder}).union(
        *(getattr(kernel, "folders", ()) for kernel in called.values())
    )
    cache_of_all = _SETTINGS.CACHE_DIR
    _SETTINGS.CACHE_DIR = _kernel_cache(folder, folders)
    try:
        # nothing calls them from C: the wrapper for that is a twentieth of the time to compile
        compiled: Any = _NJIT(
            cache=True, nogil=nogil, forceinline=forceinline, no_cfunc_wrapper=True
        )(function)
    finally:
        _SETTINGS.CACHE_DIR = cache_of_all
    compiled.folders = folders
    compiled.get_call_template = partial(_call_template, compiled)
    return cast(_F, compiled)


def jit_inlined(function: _F) -> _F:
    """Return `function` compiled as by `jit`, and put into each kernel that calls it.

    For what takes less time than a call: each array hands over nine numbers and is counted.
    """
    return jit(function, forceinline=True)


def jit_unlocked(function: _F) -> _F:
    """Return `function` compiled as by `jit`; other threads run while it waits for the system."""
    return jit(function, nogil=True)


def bound(kernel: Callable[..., _T], *arrays: Any, then: tuple[Any, ...] = ()) -> Callable[..., _T]:
    """Return the compiled `kernel` with its first arguments fixed.

    Which machine code serves the arguments' types, an ordinary call finds out anew for each of
    them, at a cost above that of most kernels; here it is found out once. `then` has an example of
    each argument that is left, whose type is not looked at any more: an array has to have the same
    type and be as contiguous. Compiles what is not compiled yet.
    """
    dispatcher: Any = kernel
    type_of: Callable[[Any], Any] = numba.typeof
    types = tuple(type_of(argument) for argument in (*arrays, *then))
    return partial(dispatcher.compile(types), *arrays)


def bound_to(bind: Callable[[*_Objects], _F]) -> Callable[[*_Objects], _F]:
    """Return `bind` that is called only where an argument is another object than the last time.

    For kernels `bound` to the arrays of up to four objects that stay the same from cycle to cycle;
    what it returned last is returned again.
    """
    # four names in place of a tuple: this is called several times a cycle
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
    """Within a kernel: copy `size` bytes from the address `source` to the address `to`."""

    def generate(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        there, here = (builder.inttoptr(address, cgutils.voidptr_t) for address in arguments[:2])
        memcpy: Callable[..., None] = cgutils.raw_memcpy
        memcpy(builder, there, here, arguments[2], 1)

    return types.void(to, source, size), generate
