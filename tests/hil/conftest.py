"""Mark all tests here `long`, and run those marked `vcan` on a real vcan0.

If the machine has no vcan0, a guest kernel boots once and a separate pytest runs all of them in it.
Their reports are replayed here test by test. Without a guest they are skipped with the reason.
"""

import os
from functools import cache
from pathlib import Path

import pytest
import vcan_guest
import vcan_replay


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Give each test its time limit in the guest, and the first one here time for all of them.

    Run them before other tests of this folder, because their common boot is the longest job. By
    then kernels should be on disk, because compilation is slow in a guest.
    """
    here = [item for item in items if Path(__file__).parent in item.path.parents]
    if here:
        first = items.index(here[0])
        here.sort(key=lambda item: not item.get_closest_marker("vcan"))
        items[first : first + len(here)] = here
    for item in here:
        item.add_marker("long")
    for item in items:
        if item.get_closest_marker("vcan") and not _runs_here():
            item.add_marker(pytest.mark.timeout(0))


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_protocol(item: pytest.Item, nextitem: pytest.Item | None) -> bool | None:
    """Replay the report of a `vcan` test from the guest. Run other tests as usual."""
    if not item.get_closest_marker("vcan") or _runs_here():
        return None
    stash = item.session.stash
    if _OUTCOME not in stash:
        wanted = [i for i in item.session.items if i.get_closest_marker("vcan")]
        stash[_OUTCOME] = vcan_replay.run_in_guest([i.nodeid for i in wanted])
    item.ihook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
    for report in vcan_replay.replay(item, stash[_OUTCOME]):
        item.ihook.pytest_runtest_logreport(report=report)
    item.ihook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
    # fixtures that the previous test kept for this one
    item.session._setupstate.teardown_exact(nextitem)
    return True


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Inside the guest, write each report for the outer run."""
    if vcan_replay.REPORTS_VARIABLE in os.environ:
        vcan_replay.append(report, os.environ[vcan_replay.REPORTS_VARIABLE])


@cache
def _runs_here() -> bool:
    return vcan_replay.REPORTS_VARIABLE in os.environ or vcan_guest.own_vcan()


_OUTCOME = pytest.StashKey[vcan_replay.Outcome]()
