"""Set up test processes, distribute files among them, and limit the time of teardowns."""

from __future__ import annotations

import gc
import os
import signal
import sys
from collections.abc import Generator, Iterator
from pathlib import Path
from typing import Any

import fork_server
import hypothesis
import pytest
import pytest_timeout
from hypothesis.internal.conjecture.providers import HypothesisProvider
from hypothesis.internal.constants_ast import Constants
from xdist.scheduler import LoadScopeScheduling

# before anything loads numpy: idle threads that spin would take cores from other processes
for _library in ("OPENBLAS", "OMP", "NUMBA"):
    os.environ.setdefault(f"{_library}_NUM_THREADS", "1")
# the tests must not find the profiles of the user who runs them
os.environ["XDG_CONFIG_HOME"] = "/nonexistent"
# tests start hundreds of processes, which must not all compile the sources again
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False
# a background job of a shell ignores Ctrl-C, and so would all processes that it starts
signal.signal(signal.SIGINT, signal.default_int_handler)
fork_server.install()
# during collection, the garbage collector would scan all imported modules again and again
gc.disable()

# Hypothesis also draws constants of the loaded modules. These depend on the tests that a process
# has run before, and so would the examples. There is no setting for it.
HypothesisProvider._local_constants = Constants()  # type: ignore[assignment]
# reuse no examples of earlier runs, and do not fail on a slow machine
hypothesis.settings.register_profile(
    "repeatable",
    derandomize=True,
    database=None,
    deadline=None,
    suppress_health_check=[hypothesis.HealthCheck.too_slow],
)
hypothesis.settings.load_profile("repeatable")


@pytest.fixture(scope="module", autouse=True)
def state_home(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Give each test file a separate state folder.

    Programs must not see the state of other files, or that of a user's robot of the same name.
    """
    with pytest.MonkeyPatch.context() as patch:
        folder = tmp_path_factory.mktemp("state")
        patch.setenv("XDG_STATE_HOME", str(folder))
        yield folder


@pytest.fixture(scope="module")
def slower_profiles(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Give shipped robots longer cycles under the same names."""
    from tests import slower_robot  # noqa: PLC0415  # loads numpy

    with pytest.MonkeyPatch.context() as patch:
        config = tmp_path_factory.mktemp("config")
        slower_robot.slower_profiles(config)
        patch.setenv("XDG_CONFIG_HOME", str(config))
        yield


@pytest.fixture(autouse=True)
def signals_as_before() -> Iterator[None]:
    """Restore the signal handlers after each test.

    A command that stops on Ctrl-C ignores it from then on. If it has run in this process, all
    processes started later would inherit that.
    """
    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    before = [(number, signal.getsignal(number)) for number in numbers]
    yield
    for number, handler in before:
        signal.signal(number, handler)


class _ByFile(LoadScopeScheduling):
    """Run each file in one process, all tests of the guest kernel in one, and all daemons in one.

    The guest kernel boots only once. Several daemons, each with two real-time processes, would
    delay each other.
    """

    def _split_scope(self, nodeid: str) -> str:
        if _of_a_daemon(nodeid):
            return "daemon"
        return "vcan" if "/test_vcan_" in nodeid else nodeid.split("::", 1)[0]


def _of_a_daemon(nodeid: str) -> bool:
    return "/hil/test_daemon_" in nodeid


_ROOT = Path(__file__).parents[1]
_KEPT = pytest.StashKey[set[Path]]()
_OURS: set[str] = set()
"""Kernels that test processes have compiled. These are not reported, even if a command needs them
too, because tests call some kernels with arrays of other types."""


def _kept_kernels() -> set[Path]:
    """Return the files of machine code in the caches of the product's kernels."""
    folders = ("cdpr_rt", "drivers", "profiles", "sim_bus", "tools")
    return {file for one in folders for file in (_ROOT / one).rglob("*.nbc")}


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add an option that `make` gives after it has compiled all kernels."""
    parser.addoption(
        "--compiled", action="store_true", help="fail where a command compiles a kernel"
    )


def pytest_sessionstart(session: pytest.Session) -> None:
    """Note which kernels are compiled before any test runs."""
    session.stash[_KEPT] = _kept_kernels() if session.config.getoption("--compiled") else set()


def pytest_testnodedown(node: Any) -> None:
    """Collect the names of kernels that a test process has compiled."""
    _OURS.update(getattr(node, "workeroutput", {}).get("compiled", ()))


@pytest.hookimpl(trylast=True)
def pytest_sessionfinish(session: pytest.Session) -> None:
    """Fail if commands had to compile kernels, because the installation should have done it.

    Delete their machine code, so that the next run fails too.
    """
    modules = [module for name, module in sys.modules.items() if name.startswith("cdpr_")]
    ours = {
        Path(value._cache._cache_file._index_path).stem
        for module in modules
        for value in vars(module).values()
        if hasattr(value, "py_func") and value.stats.cache_misses
    }
    if hasattr(session.config, "workeroutput"):
        session.config.workeroutput["compiled"] = sorted(ours)
        return
    _judge_vcan(session)
    if session.config.getoption("--compiled"):
        if os.environ.get("NUMBA_CACHE_DIR"):
            print("\nNUMBA_CACHE_DIR is set: not checked whether commands compile kernels")
            return
        late = _kept_kernels() - session.stash[_KEPT]
        late = {file for file in late if file.name.rpartition("-")[0] not in _OURS | ours}
        if late:
            names = sorted(file.name for file in late)
            print("\ncompiled by commands, missing in cdpr_tools.host.kernels:", *names)
            for file in late:
                file.unlink(missing_ok=True)
            session.exitstatus = pytest.ExitCode.TESTS_FAILED


def _is_on_vcan(nodeid: str) -> bool:
    return "/test_vcan_" in nodeid and "/test_vcan_guest" not in nodeid


def _judge_vcan(session: pytest.Session) -> None:
    """Report how many tests used a real vcan; with CDPR_VCAN=required, fail if none of them ran."""
    stats = session.config.pluginmanager.get_plugin("terminalreporter").stats
    ran, skipped = (
        sum(_is_on_vcan(one.nodeid) for outcome in kinds for one in stats.get(outcome, ()))
        for kinds in (("passed", "failed"), ("skipped",))
    )
    if ran or skipped:
        print(f"\non a real vcan: {ran} tests ran, {skipped} were skipped")
    if skipped and not ran and os.environ.get("CDPR_VCAN") == "required":
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Run daemon tests first, the longest sequence in a single process, then files with long tests.

    A long file at the end would leave all other processes idle.
    """
    long = {item.path for item in items if item.get_closest_marker("long")}
    items.sort(key=lambda item: (not _of_a_daemon(item.nodeid), item.path not in long))


def pytest_collection_finish() -> None:
    """Enable the garbage collector, but exclude all objects that exist by now."""
    gc.freeze()
    gc.enable()


def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> LoadScopeScheduling:
    """Keep files together: some share one long commissioning among their tests."""
    return _ByFile(config, log)


@pytest.hookimpl(tryfirst=True)
def pytest_pyfunc_call(pyfuncitem: pytest.Function) -> bool | None:
    """Run a test that requests a `LocalRobot` in a fork of it."""
    for value in pyfuncitem.funcargs.values():
        if hasattr(type(value), "run_in_fork"):
            value.run_in_fork(pyfuncitem)
            return True
    return None


@pytest.hookimpl(wrapper=True)
def pytest_runtest_teardown(item: pytest.Item) -> Generator[None]:
    """Limit the time of teardowns too: the limit of a test ends when the test fails."""
    settings = pytest_timeout.get_env_settings(item.config)
    if settings.timeout:
        item.ihook.pytest_timeout_set_timer(item=item, settings=settings)
    return (yield)  # pytest-timeout stops its clock after the teardown
