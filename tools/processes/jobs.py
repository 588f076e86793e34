"""Work in parts that any process can do: here, in processes of this machine, or on a cluster."""

from __future__ import annotations

import importlib
import multiprocessing
import os
import signal
import socket
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from multiprocessing.pool import Pool
from typing import Any, Protocol, TypeVar

from cdpr_tools.errors import BadInputError, WorkFailedError

_ANSWER_S, _SAFE_PATH = 5.0, "PYTHONSAFEPATH"
_LOOK_S = 1.0
"""How often is looked whether all processes live while a result is waited for."""
_T = TypeVar("_T")
_T_co = TypeVar("_T_co", covariant=True)


class Job(Protocol[_T_co]):
    """One part of the work; it can be pickled and knows all that it takes."""

    def run(self) -> _T_co:
        """Return the result, which depends on the job alone."""


class Runner(Protocol):
    """Runs jobs."""

    def __call__(self, jobs: Sequence[Job[_T]], /) -> Iterator[_T]:
        """Yield the results of jobs in their order."""


@contextmanager
def runner(workers: int, cluster: str | None) -> Iterator[Runner]:
    """Yield what runs jobs in so many processes, or on the Ray cluster at an address.

    One worker is this process. All of them end with the block, whether it is done or interrupted.
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
    """Yield results; raises WorkFailedError once a process has died, which the pool replaces."""
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
                    "a process that did a part of the work has died; is there too little memory?"
                ) from None


def cores() -> int:
    """Return how many processors this process may use."""
    return len(os.sched_getaffinity(0))


def processes(workers: int) -> Pool:
    """Return processes that end with the block; an interrupt of the terminal is ours to handle."""
    context, before = multiprocessing.get_context("spawn"), os.environ.get(_SAFE_PATH)
    # each is started with -c, which looks into the working directory before all others
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
    """Raise OSError where nobody listens at HOST:PORT, which Ray itself notices after minutes."""
    host, colon, port = address.removeprefix("ray://").rpartition(":")
    if colon and port.isdecimal():
        socket.create_connection((host, int(port)), timeout=_ANSWER_S).close()


def _in_this_process(jobs: Sequence[Job[_T]], /) -> Iterator[_T]:
    return map(_run, jobs)


def _run(job: Job[_T]) -> _T:
    return job.run()
