"""Compile the numeric kernels of the simulation to machine code."""

import hashlib
import importlib
import logging
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from numba.core import config, event, types
from typing_extensions import override

COMPILING = logging.getLogger("cdpr.compiling")
"""Is told, at level INFO, of each kernel of which no machine code is kept on this machine."""

_SETTINGS: Any = config
_NJIT: Any = numba.njit  # whose types do not know all of its options
_F = TypeVar("_F", bound=Callable[..., Any])


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
    """Tells of what is compiled for want of machine code that is kept."""

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


def _kernel_cache() -> str:
    """Return a cache directory that belongs to this state of the kernels' sources.

    numba looks only at the file of the function it compiles, not at those of the functions that
    one calls, and would go on using machine code of an older callee.
    """
    package = Path(__file__).parent
    digest = hashlib.sha256()
    for source in sorted(package.rglob("*.py")):
        text = source.read_bytes()
        if b"from cdpr_sim_bus.jit import" in text:
            digest.update(text)
    base = Path(_SETTINGS.CACHE_DIR or package / "__pycache__")
    return str(base / f"kernels-{digest.hexdigest()[:12]}")


_CACHE = _kernel_cache()


def jit(function: _F) -> _F:
    """Return `function` compiled by numba, cached on disk, with its type kept for the checker."""
    elsewhere = _SETTINGS.CACHE_DIR
    _SETTINGS.CACHE_DIR = _CACHE
    try:
        # nothing calls them from C: the wrapper for that is a twentieth of the time to compile
        compiled: Any = _NJIT(cache=True, no_cfunc_wrapper=True)(function)
    finally:
        _SETTINGS.CACHE_DIR = elsewhere
    compiled.get_call_template = partial(_call_template, compiled)
    return cast(_F, compiled)


def bound(kernel: Callable[..., Any], *arrays: Any, then: tuple[Any, ...]) -> Callable[..., Any]:
    """Return the compiled `kernel` with its first arguments fixed, so that no call looks at types.

    `then` has an example of each argument that is left.
    """
    dispatcher: Any = kernel
    type_of: Callable[[Any], Any] = numba.typeof
    types = tuple(type_of(argument) for argument in (*arrays, *then))
    return partial(dispatcher.compile(types), *arrays)
