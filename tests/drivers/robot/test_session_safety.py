"""A session receives the faults of a safety I/O."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from cdpr_drivers.modbus.safety_io import NO_TRIP, Trip
from cdpr_drivers.robot.safety import SessionSafety


@pytest.mark.parametrize(("nodes", "axis"), [((1, 2), 1), ((2, 2), -1), ((1, 3), -1)])
def test_a_trip_is_assigned_to_an_axis_only_if_its_node_id_is_unique(
    nodes: tuple[int, int], axis: int
) -> None:
    profile = SimpleNamespace(axes=[SimpleNamespace(axis="hoist", node_id=2, brake=None)])
    io = SimpleNamespace(
        profile=profile, name="chain",
        alarm=lambda: NO_TRIP, stop_reason=lambda: Trip("opened", "limit_switch", "hoist"),
    )  # fmt: skip
    found = SessionSafety(io, nodes).fault()  # type: ignore[arg-type]
    assert found is not None and found.axis == axis
