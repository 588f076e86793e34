"""Compile numeric kernels to machine code, cached on disk by their content."""

from __future__ import annotations

import fcntl
import hashlib
import importlib
import logging
import os
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import cache, partial
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any, TypeVar, cast

import numba
import numpy as np
from numba.core import codegen, config, event, runtime, types
from numba.core.caching import (
    CompileResultCacheImpl,
    FunctionCache,
    IndexDataCacheFile,
    InTreeCacheLocator,
    UserProvidedCacheLocator,
)
from numba.core.compiler import CompileResult
from numba.core.dispatcher import Dispatcher
from typing_extensions import override

from cdpr_profiles.user_folders import is_private, temporary_folder

COMPILING = logging.getLogger("cdpr.compiling")
"""Logs at level INFO each kernel that has no cached machine code on this machine."""

_LOG = logging.getLogger("cdpr.kernels")
_WARNED = "CDPR_KERNELS_NOT_KEPT"
"""Environment variable set after the warning, so that processes started later do not repeat it."""
_LAYOUT = "kernels-1"
"""Name of the folder of machine code; it changes with the naming scheme of the files."""
_UNWRITABLE = "neither the program's folder nor the user's cache can be written"
_SETTINGS: Any = config
_RUNTIME: Any = cast(Any, runtime).rtsys
_BITCODE: Any = cast(Any, codegen).ll
_NJIT: Any = numba.njit  # its types do not include all of its options
_F = TypeVar("_F", bound=Callable[..., Any])
_T = TypeVar("_T")


def _skip_blas() -> None:
    """Load numba's array functions without scipy.linalg, which saves 0.2 s per process start.

    numba searches for scipy's BLAS to decide whether kernels may call np.cov and np.corrcoef. Its
    other functions of linear algebra search for it when they are compiled.
    """
    blas = "scipy.linalg.cython_blas"
    if blas not in sys.modules:
        sys.modules[blas] = cast(Any, None)  # makes its import fail
        try:
            importlib.import_module("numba.np.arraymath")
        finally:
            del sys.modules[blas]


class _CompileListener(event.Listener):
    """Logs kernels that are compiled because no machine code is cached."""

    @override
    def on_start(self, event: Any) -> None:
        _skip_blas()
        if event.data["dispatcher"].stats.cache_path is not None:
            COMPILING.info("%s", event.data["dispatcher"].__name__)

    @override
    def on_end(self, event: Any) -> None:
        """Do nothing: no caller waits for the end."""


_listen: Callable[[str, event.Listener], None] = event.register
_listen("numba:compile", _CompileListener())


def _call_template(dispatcher: Any, args: Any, kws: Any) -> Any:
    """Make `dispatcher` compile the same machine code for constant and variable numbers."""
    general: Callable[[Any], Any] = types.unliteral
    template: Callable[..., Any] = type(dispatcher).get_call_template
    return template(
        dispatcher, tuple(map(general, args)), {key: general(value) for key, value in kws.items()}
    )


def jit(function: _F, **options: bool) -> _F:
    """Return `function` compiled by numba and cached on disk; type checkers see its own type.

    Machine code is written to NUMBA_CACHE_DIR or beside the function's module. If numba can write
    neither there nor to the user's cache, it is written to a temporary folder. If that fails too,
    it is lost at the end of the process. Machine code beside the module is read even if nothing can
    be written there: another user may have installed it. If a cache fails later, the kernel is
    compiled again.
    """
    # numba keeps separate machine code for each path to a source file: give it only one
    source = Path(function.__code__.co_filename).resolve()
    function.__code__ = function.__code__.replace(co_filename=str(source))
    # no C code calls kernels, and the C wrapper takes a twentieth of the compile time
    compile_it = partial(_NJIT, no_cfunc_wrapper=True, **options)
    compiled = None
    for base in _caches(_SETTINGS.CACHE_DIR or str(source.parent / "__pycache__")):
        before, _SETTINGS.CACHE_DIR = _SETTINGS.CACHE_DIR, str(Path(base) / _LAYOUT)
        try:
            compiled = compile_it(cache=True)(function)
        except RuntimeError:  # numba has found no folder
            continue
        finally:
            _SETTINGS.CACHE_DIR = before
        _keep_by_content(compiled)
        break
    if compiled is None:
        compiled = compile_it()(function)
        with suppress(RuntimeError):  # the function is not in a file
            compiled._cache = cast(Any, _ReadOnlyCache)(function)
            _keep_by_content(compiled)
    compiled.get_call_template = partial(_call_template, compiled)
    return cast(_F, compiled)


def _caches(usual: str) -> Iterator[str]:
    yield usual
    if (substitute := _substitute_cache()) is not None:
        yield substitute


@cache
def _substitute_cache() -> str | None:
    """Return the folder for machine code used as a last resort; None if it cannot be written.

    Logs a warning that names the folder. Child processes use the same folder and do not repeat the
    warning.
    """
    folder, kept = temporary_folder(), None
    with suppress(OSError):  # a read-only system
        folder.mkdir(mode=0o700, exist_ok=True)
        if is_private(folder, os.geteuid()):
            tempfile.TemporaryFile(dir=folder).close()
            kept = str(folder / "kernels")
    if kept is not None:
        # for child processes
        os.environ["NUMBA_CACHE_DIR"] = kept
        os.environ.setdefault("MPLCONFIGDIR", str(folder / "matplotlib"))
        _LOG.warning("note: compiled kernels are kept in %s: %s", kept, _UNWRITABLE)
    return kept


def _folder_beside(source: str) -> str:
    """Return the folder beside a source file for the machine code of its kernels."""
    name = cast(Any, UserProvidedCacheLocator).get_suitable_cache_subpath(source)
    return str(Path(source).parent / "__pycache__" / _LAYOUT / name)


class _ReadOnlyLocator(InTreeCacheLocator):
    """Finds machine code beside its source, in a folder that this user cannot write."""

    @override
    def ensure_cache_path(self) -> None:
        """Accept the folder although it cannot be written."""


class _ReadOnlyCacheFiles(CompileResultCacheImpl):
    _locator_classes: Any = (_ReadOnlyLocator,)


def machine_code_lost() -> bool:
    """Return whether this process or its parent has compiled a kernel that cannot be kept."""
    return _WARNED in os.environ


class _ReadOnlyCache(FunctionCache):
    """Machine code that can be read beside its source, but cannot be written anywhere."""

    _impl_class = _ReadOnlyCacheFiles

    @property
    @override
    def cache_path(self) -> None:
        """The folder to which machine code is written: none."""

    @override
    def save_overload(self, sig: Any, data: Any) -> None:
        """Warn that the machine code is lost, once for a command and the processes it starts."""
        if _WARNED not in os.environ:
            os.environ[_WARNED] = "1"
            _LOG.warning(
                "note: compiled kernels are not kept, so each command compiles them for minutes: "
                "%s, nor can %s; set NUMBA_CACHE_DIR to a writable folder",
                _UNWRITABLE, temporary_folder(),
            )  # fmt: skip


class _Files(IndexDataCacheFile):
    """The files of one kernel: an index, and machine code for each type of its arguments.

    numba numbers these files: two processes that compile a kernel for different types at the same
    time could take the same number. Then one's code would be called with the other's arguments.
    """

    def __init__(self, folder: str, beside: str, name: str, digest: str) -> None:
        """Write to `folder`. Read from there first, then from the folder `beside` the source."""
        made: Any = super()
        made.__init__(folder, name, digest)
        self._beside: Any = cast(Any, IndexDataCacheFile)(beside, name, digest)

    def load(self, key: Any) -> Any:
        """Return machine code from the first folder that has it, or None."""
        first: Any = super()
        for files in (first, self._beside):
            with suppress(OSError, ImportError, AttributeError):
                if (data := files.load(key)) is not None:
                    return data
        return None

    def save(self, key: Any, data: Any) -> None:
        """Write machine code, then its file name into the index."""
        name = f"{self._base}-{hashlib.sha256(repr(key).encode()).hexdigest()[:16]}.nbc"
        files: Any = self
        files._save_data(name, data)
        with _locked(files._cache_path):  # other processes may add entries to the index
            files._save_index(files._load_index() | {key: name})

    def _load_index(self) -> Any:
        """Return the index; an empty one if it has types of a module or class that has moved."""
        files: Any = super()
        with suppress(ImportError, AttributeError):
            return files._load_index()
        return {}

    @property
    def _base(self) -> str:
        return self._index_name.removesuffix(".nbi")


@contextmanager
def _locked(folder: str) -> Iterator[None]:
    """Make other processes wait before they change an index in this folder."""
    opened = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        with suppress(OSError):  # a file system without locks: an entry may get lost
            fcntl.flock(opened, fcntl.LOCK_EX)
        yield
    finally:
        os.close(opened)


def _keep_by_content(kernel: Any) -> None:
    """Cache machine code of `kernel` under the digest of its content, see `_content`.

    numba compares the age of the source file instead: it compiles a whole file again after a touch,
    and keeps machine code that contains an old version of a kernel from another file.
    """
    kept, files = kernel._cache, cast(Any, _Files)

    @cache
    def open_cache() -> None:
        digest = _content(kernel)
        kept._cache_file = files(
            kept._cache_path,
            _folder_beside(kernel.py_func.__code__.co_filename),
            f"{kernel.__module__}.{kernel.__qualname__}-{digest[:16]}",
            digest,
        )

    def load(signature: Any, target_context: Any) -> Any:
        open_cache()
        # numba first loads everything for compilation, in 0.1 s; machine code needs only this
        _RUNTIME.initialize(target_context)
        with suppress(OSError):
            return kept._load_overload(signature, target_context)
        return None

    def save(*given: Any) -> None:
        open_cache()
        with suppress(OSError):
            type(kept).save_overload(kept, *given)

    kept.open, kept.load_overload, kept.save_overload = open_cache, load, save
    kept._impl.rebuild = _rebuild


def _rebuild(target_context: Any, payload: Any) -> Any:
    """Return the compile result of a cached kernel; parse its bitcode only if it is needed.

    numba parses the bitcode of each kernel when it loads it, which takes twice as long as all other
    loading. Only kernels that call this one, and are compiled later, need the bitcode.
    """
    rebuild: Callable[..., Any] = CompileResult._rebuild
    try:
        (name, kind, (machine_code, bitcode)), described, *others = payload
        engine = target_context.codegen()._engine
    except (ValueError, AttributeError):  # a version of numba that stores them differently
        return rebuild(target_context, *payload)
    engine._defined_symbols |= {described.llvm_func_name, described.llvm_cpython_wrapper_name}
    stored = name, kind, (machine_code, _empty_bitcode())
    result = rebuild(target_context, stored, described, *others)
    code = result.library
    code._shared_module = None

    def module_for_linking() -> Any:
        if code._shared_module is None:
            code._shared_module = _BITCODE.parse_bitcode(bitcode)
            engine._load_defined_symbols(code._shared_module)
        return code._shared_module

    code._get_module_for_linking = module_for_linking
    return result


@cache
def _empty_bitcode() -> bytes:
    empty: bytes = _BITCODE.parse_assembly("").as_bitcode()
    return empty


def _content(kernel: Any) -> str:
    """Return a digest of a kernel, of the constants it uses, and of all kernels that it calls.

    Compute it at the first call of the kernel, not before: a kernel may call others that are
    defined further down in its file.
    """
    digest, seen, left = hashlib.sha256(), set(), [kernel]
    while left:
        one = left.pop()
        if one not in seen:
            seen.add(one)
            text, called = _own_content(one)
            digest.update(text.encode())
            left += called
    return digest.hexdigest()


@cache
def _own_content(kernel: Any) -> tuple[str, Sequence[Any]]:
    """Return the content of one kernel, as text, and the kernels that it names."""
    function, called = kernel.py_func, []
    text = [repr(sorted(kernel.targetoptions.items()))]
    cells = zip(function.__code__.co_freevars, function.__closure__ or (), strict=True)
    named = function.__globals__ | {name: cell.cell_contents for name, cell in cells}
    for code in _codes(function.__code__):
        text += [code.co_code.hex(), repr(code.co_varnames), repr(code.co_names)]
        text += [
            repr(one)
            for one in code.co_consts
            if not isinstance(one, CodeType) and one != function.__doc__
        ]
        values = [named[name] for name in (*code.co_names, *code.co_freevars) if name in named]
        for value in values:
            if isinstance(value, Dispatcher):
                called.append(value)
                continue
            if isinstance(value, ModuleType | type):  # only the used attributes, not the whole
                values += [vars(value)[name] for name in code.co_names if name in vars(value)]
            text.append(_constant_text(value))
    return "\n".join(text), called


def _codes(code: CodeType) -> Iterator[CodeType]:
    yield code
    for one in code.co_consts:
        if isinstance(one, CodeType):
            yield from _codes(one)


def _constant_text(value: Any) -> str:
    """Return a text for a constant, the same in every process; for other objects, their name."""
    if isinstance(value, np.ndarray):
        return f"{value.dtype} {value.shape} {hashlib.sha256(value.tobytes()).hexdigest()}"
    if isinstance(value, tuple):
        return ",".join(map(_constant_text, value))
    if isinstance(value, int | float | str | np.generic | np.dtype):
        return repr(value)
    made_of = getattr(value, "_defn", value)  # of an intrinsic
    codes = _codes(made_of.__code__) if hasattr(made_of, "__code__") else ()
    return f"{getattr(value, '__qualname__', type(value))}" + "".join(
        code.co_code.hex() + repr([one for one in code.co_consts if not isinstance(one, CodeType)])
        for code in codes
    )


def bound(kernel: Callable[..., _T], *arrays: Any, then: tuple[Any, ...] = ()) -> Callable[..., _T]:
    """Return the compiled `kernel` with its first arguments fixed.

    An ordinary call looks up the machine code for the types of its arguments every time, which
    costs more than most kernels. The bound kernel looks it up once. `then` has an example of each
    remaining argument. Later calls do not check types, so an array must have the type and
    contiguity of its example. Compiles the kernel if necessary.
    """
    dispatcher: Any = kernel
    type_of: Callable[[Any], Any] = numba.typeof
    types = tuple(type_of(argument) for argument in (*arrays, *then))
    return partial(dispatcher.compile(types), *arrays)
