"""All tests here are `long`; those marked `vcan` run on a real vcan0, in a guest kernel if need be.

In the second case one boot runs all of them, by a pytest of its own inside, whose reports are
replayed here test by test. Without a guest they are reported as skipped, with the reason.
"""

import os
from functools import cache
from pathlib import Path

import pytest
import vcan_guest
import vcan_replay


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Each test has its time limit in the guest; the first of them waits for all, out here.

    They come before the others of this folder: one boot for all is the longest there is to share
    out, but kernels should be on disk by then, since to compile is slow in a guest.
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
    """Replay what a `vcan` test did in the guest; every other test runs as usual."""
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
    # what the test before left set up for this one's sake
    item.session._setupstate.teardown_exact(nextitem)
    return True


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Inside the guest, hand every report to the run outside."""
    if vcan_replay.REPORTS_VARIABLE in os.environ:
        vcan_replay.append(report, os.environ[vcan_replay.REPORTS_VARIABLE])


@cache
def _runs_here() -> bool:
    return vcan_replay.REPORTS_VARIABLE in os.environ or vcan_guest.own_vcan()


_OUTCOME = pytest.StashKey[vcan_replay.Outcome]()
