"""Fork commands from a server that has already imported everything.

The tests start hundreds of commands. Each would need a second of processor time to import numba and
numpy, load its kernels and tear everything down again. A forked process behaves like a new one: it
has the arguments, environment, folder, descriptors, session and signals that the caller gave to
`subprocess`. At its end it joins threads, runs atexit functions and flushes its output, but does
not free its memory piece by piece. If the test process dies, the server and its forks are killed.

The two processes of a daemon check that the launcher is their parent. Therefore each launcher has
a separate server and adopts the processes that this server forks: for that moment the launcher is
the subreaper of orphaned descendants.

A process that cannot be forked is started as usual. So is every process with CDPR_TEST_FORKS=0 in
its environment.
"""

from __future__ import annotations

import atexit
import ctypes
import fcntl
import gc
import importlib
import json
import os
import pkgutil
import resource
import runpy
import select
import selectors
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NoReturn

_COMMAND = "cdpr_tools.cli"
FORKED = (sys.executable, "-X", "forked", "-c")
"""Prefix of a command that runs a script in a forked process: append the script and its arguments.
Python ignores the option."""
_SCRIPT = "-c"
_LAUNCHER_RIG = "launcher_rig"
"""A launcher whose loop and service are stand-ins, found by PYTHONPATH."""
_OF_A_LAUNCHER = {
    "cdpr_tools.daemon.loop_process",
    "cdpr_tools.daemon.service_process",
    "stand_in_loop",
    "stand_in_service",
}
_STARTED_BY = [sys.executable, "-P", str(Path(__file__).resolve())]
_ROOM = " " * 8192
"""Last argument of the server, which reserves room for the arguments that /proc shows of a fork."""
_SPECIAL = ("PYTHON", "NUMBA", "LD_", "MALLOC", "OPENBLAS", "OMP")
"""Prefixes of variables that Python and libraries read at startup."""
_FINDS_ITS_CHILDREN = "verify"
"""A command that finds its processes by their environment in /proc, which a fork cannot change."""
_LAUNCHES = "run"
"""The command that is a launcher: its processes, and tests, check who their parent is."""
_WHEN_NEEDED = ("httpcore", "rich.markdown", "scipy.signal")
"""Modules that commands load late."""
_PR_SET_PDEATHSIG, _PR_SET_CHILD_SUBREAPER = 1, 36
_SWITCH = "CDPR_TEST_FORKS"
_MOST_BYTES = 1 << 17
_OUT_OF_THE_WAY = 200


_Popen = subprocess.Popen
_connections: dict[int, socket.socket] = {}
"""Connection of each process id. A forked process has to open a new one."""
_address: list[str] = []
_own: list[socket.socket] = []
"""In a launcher: the socket to its separate server."""
_asking = threading.Lock()
"""Held from a request until its answer, so that no other thread receives it."""


def _ask(request: dict[str, Any], descriptors: Sequence[int] = ()) -> int:
    """Return the server's answer to `request`. Start the server on first use."""
    with _asking:
        if not _address:
            _start_server()
        pid = os.getpid()
        if pid not in _connections:
            _connections[pid] = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
            _connections[pid].connect(_address[0])
        message = json.dumps(request | {"address": _address[0]}).encode()
        try:
            socket.send_fds(_connections[pid], [message], list(descriptors))
            return int(_connections[pid].recv(64))
        except BaseException:  # a late answer must not be taken for that to the next request
            _connections.pop(pid).close()
            raise


def _start_server() -> None:
    _address.append(f"\0cdpr-tests/{os.getpid()}")
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    listener.bind(_address[0])
    listener.listen()
    lifeline, kept = os.pipe()
    os.set_inheritable(kept, False)  # open as long as this process lives
    numbers = [listener.fileno(), lifeline]
    _Popen([*_STARTED_BY, *map(str, numbers), _ROOM], pass_fds=numbers)
    listener.close()
    os.close(lifeline)


class ForkingPopen(_Popen):  # type: ignore[type-arg]
    """A subprocess.Popen that forks our commands from the server."""

    _forked = False

    def _execute_child(self, *given: Any) -> None:
        args, executable, preexec_fn, _, pass_fds, cwd, env, _, _, shell = given[:10]
        p2cread, p2cwrite, c2pread, c2pwrite, errread, errwrite = given[10:16]
        _, gid, gids, uid, umask, session, group = given[16:]
        words = [os.fspath(word) for word in args] if isinstance(args, list | tuple) else []
        wanted = dict(os.environ if env is None else env)
        special = executable, preexec_fn, shell or None, gid, gids, uid
        module = _module_of(words)
        if (
            module not in {_COMMAND, _LAUNCHER_RIG, _SCRIPT} | (_OF_A_LAUNCHER if _own else set())
            or any(value is not None for value in special)
            or umask != -1
            or group != -1
            or wanted.get(_SWITCH) == "0"
            or any(_of_start(wanted, name) for name in {*wanted, *os.environ})
            or _limits() != _AT_FIRST
        ):
            super()._execute_child(*given)
            return
        standard = [
            number if mine == -1 else mine
            for number, mine in enumerate((p2cread, c2pwrite, errwrite))
        ]
        request = {
            "words": words,
            "env": wanted,
            "cores": sorted(os.sched_getaffinity(0)),
            "cwd": os.fspath(cwd) if cwd else str(Path.cwd()),
            "session": bool(session),
            "pass": list(pass_fds),
        }
        if _own:
            self.pid = _adopt(request, [*standard, *pass_fds])
        else:
            self.pid = _ask(request, [*standard, *pass_fds])
            self._forked = True
            self._pidfd = os.pidfd_open(self.pid)
        self._child_created = True
        null = getattr(self, "_devnull", None)
        for ours, theirs in ((p2cwrite, p2cread), (c2pread, c2pwrite), (errread, errwrite)):
            if theirs != -1 and ours != -1 and theirs != null:
                os.close(theirs)
        if null is not None:
            os.close(null)
        self._closed_child_pipe_fds = True

    def _try_wait(self, wait_flags: int) -> tuple[int, int]:
        if not self._forked:
            return super()._try_wait(wait_flags)  # type: ignore[misc,no-any-return]
        poll = select.poll()
        poll.register(self._pidfd, select.POLLIN)
        if not poll.poll(0 if wait_flags == os.WNOHANG else None):
            return 0, 0
        status = _ask({"status": self.pid})
        os.close(self._pidfd)
        return self.pid, status

    def _internal_poll(self, *given: Any, **more: Any) -> int | None:
        if not self._forked:
            return super()._internal_poll(*given, **more)  # type: ignore[misc,no-any-return]
        if more and _asking.locked():
            return None  # the garbage collector interrupted a request
        # as in Popen: only one of two threads asks for the exit status
        if self.returncode is None and self._waitpid_lock.acquire(False):
            try:
                if self.returncode is None:
                    pid, status = self._try_wait(os.WNOHANG)
                    if pid == self.pid:
                        self._handle_exitstatus(status)  # type: ignore[attr-defined]
            finally:
                self._waitpid_lock.release()
        return self.returncode


def _module_of(words: list[str]) -> str:
    """Return the module that a command line runs, "" if it runs none."""
    if words[:4] == [*FORKED]:
        return _SCRIPT
    if words[:2] == [sys.executable, "-P"]:
        words = [words[0], *words[2:]]
    return words[2] if words[:2] == [sys.executable, "-m"] and len(words) > 2 else ""


def _adopt(request: dict[str, Any], descriptors: Sequence[int]) -> int:
    """Have the launcher's server start a process. Adopt it and return its pid."""
    prctl = ctypes.CDLL(None).prctl
    prctl(_PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
    try:
        socket.send_fds(_own[0], [json.dumps(request).encode()], list(descriptors))
        return int(_own[0].recv(64))
    finally:
        prctl(_PR_SET_CHILD_SUBREAPER, 0, 0, 0, 0)


def _limits() -> list[tuple[int, int]]:
    """Return the resource limits that a process inherits."""
    return [resource.getrlimit(what) for what in (resource.RLIMIT_NOFILE, resource.RLIMIT_FSIZE)]


_AT_FIRST = _limits()


def _of_start(wanted: dict[str, str], name: str) -> bool:
    differs = wanted.get(name) != os.environ.get(name)
    return differs and name.startswith(_SPECIAL) and name != "PYTHONPATH"


def install() -> None:
    """Make this process fork its commands from now on."""
    subprocess.Popen = ForkingPopen  # type: ignore[misc]


# -- the server


def _serve(listener: socket.socket, lifeline: int) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _import_all()
    kernels = _Kernels()
    gc.collect()
    selector = selectors.DefaultSelector()
    selector.register(listener, selectors.EVENT_READ)
    selector.register(lifeline, selectors.EVENT_READ)
    while True:
        for key, _ in selector.select():
            if key.fd == lifeline:
                os._exit(0)
            assert isinstance(key.fileobj, socket.socket)
            if key.fileobj is listener:
                selector.register(listener.accept()[0], selectors.EVENT_READ)
            elif not _obey(key.fileobj, selector, kernels):
                selector.unregister(key.fileobj)
                key.fileobj.close()


def _obey(client: socket.socket, selector: selectors.BaseSelector, kernels: Any) -> bool:
    """Answer one request of a client. Return False if the client has disconnected."""
    message, descriptors = _received(client)
    if not message:
        return False
    request = json.loads(message)
    if "status" in request:
        answer = os.waitpid(request["status"], 0)[1]
    else:
        kernels.load()
        gc.freeze()
        answer = os.fork()
        if answer == 0:
            # no process outlives the test that started it
            ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
            _address[:] = [request["address"]]
            for key in [*selector.get_map().values()]:
                os.close(key.fd)
            selector.close()
            _become(request, descriptors)
        for descriptor in descriptors:
            os.close(descriptor)
    with suppress(ConnectionError):  # an interrupted client has closed its connection
        client.send(str(answer).encode())
    return True


def _received(client: socket.socket) -> tuple[bytes, list[int]]:
    try:
        message, descriptors, _, _ = socket.recv_fds(client, _MOST_BYTES, 16)
    except ConnectionError:
        return b"", []
    return message, descriptors


class _Kernels:
    """The kernels of the loaded modules, and which of their machine code is loaded."""

    def __init__(self) -> None:
        dispatcher = importlib.import_module("numba.core.dispatcher").Dispatcher
        ours = [module for name, module in sys.modules.items() if name.startswith("cdpr_")]
        found = {id(value): value for module in ours for value in vars(module).values()}
        self._seen_ns: dict[Any, int] = {}
        for kernel in found.values():
            # a kernel without a cache has nothing to load
            if isinstance(kernel, dispatcher) and hasattr(kernel._cache, "open"):
                kernel._cache.open()
                self._seen_ns[kernel] = 0

    def load(self) -> None:
        """Load machine code that has been added on disk."""
        for kernel, seen_ns in self._seen_ns.items():
            file = kernel._cache._cache_file
            try:
                changed_ns = Path(file._index_path).stat().st_mtime_ns
            except FileNotFoundError:
                continue
            if changed_ns != seen_ns:
                for signature, *_ in file._load_index():
                    kernel.compile(signature)
                self._seen_ns[kernel] = changed_ns


def _import_all() -> None:
    for name in ("cdpr_tools", "cdpr_sim_bus", "cdpr_rt"):
        package = importlib.import_module(name)
        for module in pkgutil.walk_packages(package.__path__, f"{name}."):
            importlib.import_module(module.name)
    for name in _WHEN_NEEDED:
        importlib.import_module(name)


def _serve_launcher(client: socket.socket) -> NoReturn:
    """Start processes as orphans, which the launcher adopts. The launcher is this one's parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    while True:
        message, descriptors = _received(client)
        if not message:
            os._exit(0)
        told, tell = os.pipe()
        wait, go = os.pipe()
        between = os.fork()
        if between == 0:
            child = os.fork()
            if child:
                os.write(tell, str(child).encode())
                os._exit(0)
            for number in (told, tell, go, client.fileno()):
                os.close(number)
            os.read(wait, 1)  # until the launcher has adopted this process
            os.close(wait)
            _become(json.loads(message), descriptors)
        os.waitpid(between, 0)
        client.send(os.read(told, 64))
        for number in (told, tell, wait, go, *descriptors):
            os.close(number)


def _become(request: dict[str, Any], descriptors: list[int]) -> NoReturn:
    words = request["words"]
    module = _module_of(words)
    arguments = words[words.index(module) + 1 :]
    _be_shown_as(words)
    if request["session"]:
        os.setsid()
    sys.path += request["env"].get("PYTHONPATH", "").split(os.pathsep)
    if module == _LAUNCHER_RIG or arguments[:1] == [_LAUNCHES]:
        _get_own_server(descriptors)
    if module in (_COMMAND, _LAUNCHER_RIG, _SCRIPT) and _FINDS_ITS_CHILDREN not in arguments[:2]:
        install()
    signal.signal(signal.SIGINT, signal.default_int_handler)
    os.sched_setaffinity(0, request["cores"])
    os.environ.clear()
    os.environ.update(request["env"])
    os.chdir(request["cwd"])
    away = [fcntl.fcntl(number, fcntl.F_DUPFD, _OUT_OF_THE_WAY) for number in descriptors]
    for number in descriptors:
        os.close(number)
    for number, place in zip(away, [0, 1, 2, *request["pass"]], strict=True):
        os.dup2(number, place)
        os.close(number)
    sys.stdin = open(0, closefd=False)  # noqa: SIM115
    sys.stdout = open(1, "w", 1 if os.isatty(1) else -1, closefd=False)  # noqa: SIM115
    sys.stderr = open(  # noqa: SIM115
        2, "w", 1, closefd=False, errors="backslashreplace"
    )
    sys.argv = [module, *arguments]
    sys.modules.pop(module, None)
    with _quick_end():
        if module == _SCRIPT:
            exec(sys.argv.pop(1), {"__name__": "__main__"})
        else:
            runpy.run_module(module, run_name="__main__", alter_sys=True)
    sys.exit()


def _get_own_server(descriptors: list[int]) -> None:
    mine, its = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    if os.fork() == 0:
        for number in (mine.fileno(), *descriptors):
            os.close(number)
        _serve_launcher(its)
    its.close()
    # above all descriptors that the process gets
    _own.append(socket.socket(fileno=fcntl.fcntl(mine, fcntl.F_DUPFD_CLOEXEC, _OUT_OF_THE_WAY)))
    mine.close()


@contextmanager
def _quick_end() -> Iterator[None]:
    """At the end of the block, exit as the interpreter does but without freeing memory.

    Leave every end but an orderly exit to the interpreter.
    """
    code: Any = None
    try:
        yield
    except SystemExit as ended:
        code = ended.code
        if not isinstance(code, int | None):
            raise
    threading._shutdown()  # type: ignore[attr-defined]
    atexit._run_exitfuncs()
    try:
        sys.stdout.flush()
        sys.stderr.flush()
    except OSError:
        sys.exit(code)
    os._exit((code or 0) & 0xFF)


def _be_shown_as(words: list[str]) -> None:
    """Make /proc show `words` as the arguments of this process."""
    fields = Path("/proc/self/stat").read_text().rpartition(")")[2].split()
    begin, end = int(fields[45]), int(fields[46])
    text = b"\0".join(word.encode() for word in words)[: end - begin - 1]
    ctypes.memmove(begin, text.ljust(end - begin, b"\0"), end - begin)


if __name__ == "__main__":
    _serve(socket.socket(fileno=int(sys.argv[1])), int(sys.argv[2]))
