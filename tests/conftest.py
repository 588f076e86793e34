"""How the tests are shared out between processes."""

from __future__ import annotations

import os
from typing import Any

import pytest
from xdist.scheduler import LoadScopeScheduling

# before anything loads numpy: threads that spin for work take the cores of the other processes
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


class _ByFile(LoadScopeScheduling):
    """One process for each file, and one for all that run in the guest kernel's single boot."""

    def _split_scope(self, nodeid: str) -> str:
        file = nodeid.split("::", 1)[0]
        return "vcan" if "/test_vcan_" in file else file


def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> LoadScopeScheduling:
    """Keep files together: some make one long commissioning for all of their tests."""
    return _ByFile(config, log)
