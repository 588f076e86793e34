"""A Ray cluster computes the same results as this process."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import pytest
from cdpr_here import cdpr_here

COMMANDS = {
    "workspace": ("robot", "workspace", "planar-3", "--cells", "12", "--rays", "40"),
    "study": ("calibrate", "study", "--draws", "2"),
}


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    utils = pytest.importorskip("ray.cluster_utils")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RAY_USAGE_STATS_ENABLED", "0")
        cluster = utils.Cluster(
            initialize_head=True, head_node_args={"num_cpus": 2, "include_dashboard": False}
        )
        yield cluster.address
        cluster.shutdown()


def result_of(*words: str) -> Any:
    done = cdpr_here(*words, "--json")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


@pytest.mark.long
@pytest.mark.parametrize("command", COMMANDS)
def test_a_cluster_gives_the_same_result(command: str, address: str) -> None:
    words = COMMANDS[command]
    assert result_of(*words, "--cluster", address) == result_of(*words)
