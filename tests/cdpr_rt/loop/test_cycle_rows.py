"""Each field of a row comes from where its declaration says."""

from __future__ import annotations

import struct
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from cdpr_rt.core.cycle_row import AXIS_FIELDS, FIELDS, POSE_FIELDS, SCALAR_FIELDS, cycle_dtype
from cdpr_rt.core.shared_block import SharedBlock
from cdpr_rt.loop.engine import _CODES, CycleRows

_N = 3


def _put(engine: SimpleNamespace, source: str, value: Any) -> None:
    *path, last = source.split(".")
    for name in path:
        if not hasattr(engine, name):
            setattr(engine, name, SimpleNamespace())
        engine = getattr(engine, name)
    setattr(engine, last, value)


def _engine() -> SimpleNamespace:
    """Return a stand-in for the engine that has a different value at each field's source."""
    engine, random = SimpleNamespace(), np.random.default_rng(3)
    for number, field in enumerate(SCALAR_FIELDS):
        _put(engine, field.source, number)
    for field in AXIS_FIELDS:
        _put(engine, field.source, random.integers(0, 2, _N).astype(field.kind))
        if field.kind == "<f8":
            _put(engine, field.source, random.normal(size=_N))
    for field in POSE_FIELDS:
        _put(engine, field.source, random.normal(size=7))
    return engine


def _at(engine: Any, source: str) -> Any:
    for name in source.split("."):
        engine = getattr(engine, name)
    return engine


def test_each_field_is_written_from_its_source() -> None:
    """Also in the second row, after values have changed in place."""
    block = SharedBlock.create(_N, 1.0, 500.0)
    rows, engine = CycleRows(block), _engine()
    rows.follow(engine)
    rows.write(engine)
    engine.last_program.pose = None
    _at(engine, FIELDS["position_rad"].source)[:] += 1.0
    rows.write(engine)
    for name, field in FIELDS.items():
        if name != "pose":
            np.testing.assert_array_equal(block.rows[1][name], _at(engine, field.source), name)
    assert np.isnan(block.rows[1]["pose"]).all()
    assert np.isfinite(block.rows[0]["pose"]).all()
    assert int(block.counters["rows"][0]) == 2


@pytest.mark.parametrize(
    "array", [np.zeros(_N, np.float32), np.zeros(_N + 1), np.zeros(2 * _N)[::2]]
)
def test_an_array_of_another_layout_is_rejected(array: Any) -> None:
    rows, engine = CycleRows(SharedBlock.create(_N, 1.0, 500.0)), _engine()
    _put(engine, FIELDS["tension_N"].source, array)
    with pytest.raises(TypeError, match=r"estimate\.tension_N: .*allowed: .*contiguous"):
        rows.follow(engine)


@pytest.mark.parametrize("kind", ["?", "<u1", "<u2", "<i2", "<u4", "<i4", "<u8", "<i8", "<f8"])
def test_a_scalar_of_any_kind_is_packed_as_numpy_reads_it(kind: str) -> None:
    """Also kinds that no field has yet."""
    assert np.frombuffer(struct.pack(f"<{_CODES[kind]}", 1), kind).tolist() == [1]


def test_every_field_has_a_meaning() -> None:
    """And each field is in the row once."""
    assert all(field.meaning for field in FIELDS.values())
    assert [name for name in cycle_dtype(_N).names or () if name != "spare"] == list(FIELDS)


def test_the_page_on_recordings_names_every_field() -> None:
    page = (Path(__file__).parents[3] / "docs" / "how-to" / "recordings.md").read_text()
    assert [name for name in FIELDS if f"`{name}`" not in page] == []
