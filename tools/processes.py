"""Work in parts that any process can do: here, in local processes, or on a cluster."""

from __future__ import annotations

import importlib
import math
import multiprocessing
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from multiprocessing.pool import Pool
from typing import Any, Final, Protocol, TypeVar

from cdpr_tools.errors import BadInputError, WorkFailedError

_ANSWER_S, _SAFE_PATH = 5.0, "PYTHONSAFEPATH"
_LOOK_S = 1.0
"""Interval of the check that all processes live while a result is awaited."""
_T = TypeVar("_T")
_T_co = TypeVar("_T_co", covariant=True)


class Job(Protocol[_T_co]):
    """One part of the work; it can be pickled and contains all its input."""

    def run(self) -> _T_co:
        """Return the result, which depends only on the job."""


class Runner(Protocol):
    """Runs jobs."""

    def __call__(self, jobs: Sequence[Job[_T]], /) -> Iterator[_T]:
        """Yield the results of jobs in their order."""


@contextmanager
def runner(workers: int, cluster: str | None) -> Iterator[Runner]:
    """Yield a runner of jobs in `workers` processes, or on the Ray cluster at an address.

    One worker is this process. All processes end with the block, even after an interrupt.
    """
    if cluster is not None:
        with _ray(cluster) as run:
            yield run
    elif workers == 1:
        yield _in_this_process
    else:
        with processes(workers) as pool:

            def in_processes(jobs: Sequence[Job[_T]], /) -> Iterator[_T]:
                return _by_pool(pool, jobs)

            yield in_processes


def _by_pool(pool: Pool, jobs: Sequence[Job[_T]]) -> Iterator[_T]:
    """Yield results; raises WorkFailedError if a process has died (the pool replaces it)."""
    started = {child.pid for child in multiprocessing.active_children()}
    results = pool.imap(_run, jobs)
    while True:
        try:
            yield results.next(_LOOK_S)
        except StopIteration:
            return
        except multiprocessing.TimeoutError:
            if not started <= {child.pid for child in multiprocessing.active_children()}:
                raise WorkFailedError(
                    "a worker process has died; is there too little memory?"
                ) from None


def cores() -> int:
    """Return how many processors this process may use."""
    return len(os.sched_getaffinity(0))


def processes(workers: int) -> Pool:
    """Return processes that end with the block; they ignore an interrupt of the terminal."""
    context, before = multiprocessing.get_context("spawn"), os.environ.get(_SAFE_PATH)
    # each is started with -c, which searches the working directory before all others
    os.environ[_SAFE_PATH] = "1"
    try:
        return context.Pool(workers, signal.signal, (signal.SIGINT, signal.SIG_IGN))
    finally:
        del os.environ[_SAFE_PATH]
        if before is not None:
            os.environ[_SAFE_PATH] = before


@contextmanager
def _ray(address: str) -> Iterator[Runner]:
    try:
        ray: Any = importlib.import_module("ray")
    except ModuleNotFoundError:
        raise BadInputError(
            f"--cluster {address}: needs ray, which comes with: pip install 'cdpr-rt[cluster]'"
        ) from None
    try:
        _require_listener(address)
        ray.init(address=address, log_to_driver=False, logging_level="error")
    except (ConnectionError, OSError, RuntimeError, ValueError) as error:
        raise WorkFailedError(f"--cluster {address}: {str(error).splitlines()[0]}") from error
    try:
        remote = ray.remote(_run)

        def run(jobs: Sequence[Job[_T]], /) -> Iterator[_T]:
            for result in [remote.remote(job) for job in jobs]:
                try:
                    yield ray.get(result)
                except ray.exceptions.RayError as error:
                    reason = str(error).strip().splitlines()[-1]
                    raise WorkFailedError(f"--cluster {address}: {reason}") from error

        yield run
    finally:
        ray.shutdown()


def _require_listener(address: str) -> None:
    """Raise OSError if nobody listens at HOST:PORT, which Ray itself notices only after minutes."""
    host, colon, port = address.removeprefix("ray://").rpartition(":")
    if colon and port.isdecimal():
        socket.create_connection((host, int(port)), timeout=_ANSWER_S).close()


def _in_this_process(jobs: Sequence[Job[_T]], /) -> Iterator[_T]:
    return map(_run, jobs)


def _run(job: Job[_T]) -> _T:
    return job.run()


# Modules of this project that run as separate processes.

_MODULE_PROCESS_LOOK_S: Final = 0.1


def module_command(module: str, *arguments: str) -> list[str]:
    """Return the command line that runs a module with this interpreter.

    Nothing in the working directory can replace installed modules (-P).
    """
    return [sys.executable, "-P", "-m", module, *arguments]


_NICER: Final = 10
MOST_KiB: Final = 4 << 20


def module_command_beside(module: str, *arguments: str, most_KiB: int = MOST_KiB) -> list[str]:
    """Return the command line of a module for work beside a robot: limited memory, low priority.

    The limit keeps a user's file from exhausting the machine's memory.
    """
    within = f'ulimit -v {most_KiB} && exec nice -n{_NICER} "$@"'
    return ["sh", "-c", within, "sh", *module_command(module, *arguments)]


def end_by_stdin(process: subprocess.Popen[Any], timeout_s: float) -> None:
    """Close the standard input of a process that ends with it; kill it if it does not end in time.

    An interrupt kills it too. Its pipes are read while it runs, then closed. Its own children
    may keep them open.
    """
    with process:
        try:
            for _ in range(math.ceil(timeout_s / _MODULE_PROCESS_LOOK_S)):
                with suppress(subprocess.TimeoutExpired):
                    process.communicate(timeout=_MODULE_PROCESS_LOOK_S)
                if process.poll() is not None:
                    return
        finally:
            process.kill()
