"""Rows as JSON: the values of the row, and valid by the schema."""

import json
import math

import jsonschema_rs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdpr_rt.core.cycle_row import AXES, FIELDS, SCALARS, WALL_TIMES, cycle_dtype
from cdpr_rt.service.recording import RowTexts
from cdpr_rt.service.recording_file import CYCLE_FIELDS, TIMING_FIELDS, cycle_schema, timing_schema
from tests.cdpr_rt.service.recording_rig import made_rows

_TEXTS = {n: RowTexts(n, FIELDS) for n in (1, 16)}


def _written(values: list[float]) -> list[float | None]:
    rows = np.zeros(len(values), cycle_dtype(1))
    rows["time_s"] = values
    return [json.loads(text)["time_s"] for text in _TEXTS[1](rows)]


@given(st.lists(st.floats(), min_size=1, max_size=40))
@settings(max_examples=100)
def test_any_number_is_read_back_to_a_billionth(values: list[float]) -> None:
    for value, read in zip(values, _written(values), strict=True):
        if not math.isfinite(value):
            assert read is None
        elif abs(value) < 1e300:
            assert read is not None
            assert math.isclose(read, value, rel_tol=1e-13, abs_tol=0.51e-9)
        else:
            assert read is not None and abs(read) > 1e299 and read * value > 0


@given(data=st.data())
@settings(max_examples=60)
def test_any_value_of_integer_fields_is_read_back_exactly(data: st.DataObject) -> None:
    rows = np.zeros(3, cycle_dtype(16))
    for name in (*SCALARS, *AXES):
        kind = rows.dtype[name].base
        if kind.kind not in "iu":
            continue
        limits = np.iinfo(kind)
        most = min(int(limits.max), 2**63 - 1)
        numbers = st.integers(max(int(limits.min), -(2**63) + 1), most)
        drawn = data.draw(st.lists(numbers, min_size=3, max_size=3))
        rows[name] = np.array(drawn, kind).reshape((3,) + (1,) * (rows[name].ndim - 1))
    for row, text in zip(rows, _TEXTS[16](rows), strict=True):
        read = json.loads(text)
        for name in (*SCALARS, *AXES):
            if rows.dtype[name].base.kind in "iu":
                assert read[name] == row[name].tolist()


def test_many_rows_give_the_same_texts_as_single_rows() -> None:
    rows = made_rows(0, 700, 16)
    texts = _TEXTS[16](rows)
    assert len(texts) == 700
    assert [texts[k] for k in (0, 255, 256, 699)] == [
        _TEXTS[16](rows[k : k + 1])[0] for k in (0, 255, 256, 699)
    ]


@pytest.mark.parametrize("n", [1, 16])
def test_texts_are_valid_by_the_schema(n: int) -> None:
    rows = made_rows(10, 4, n)
    rows["pose"][0] = [1, 2, 3, 1, 0, 0, 0]
    check = jsonschema_rs.Draft7Validator(cycle_schema(n))
    texts = RowTexts(n, CYCLE_FIELDS)(rows)
    for text in texts:
        check.validate(json.loads(text))
    timing = jsonschema_rs.Draft7Validator(timing_schema())
    for text in RowTexts(n, TIMING_FIELDS)(rows):
        timing.validate(json.loads(text))
        assert json.loads(text).keys() == {"cycle", *WALL_TIMES}
    value = json.loads(texts[0])
    assert list(value) == [name for name in FIELDS if name not in WALL_TIMES]
    for name in value:
        wanted = rows[name][0].tolist()
        read = value[name]
        if rows.dtype[name].base.kind == "f":
            wanted, read = np.ravel(wanted), np.ravel(np.array(read, float))
            np.testing.assert_allclose(read, wanted, rtol=0, atol=0.51e-9)
        else:
            assert read == wanted
    for name, wrong in (("cycle", None), ("position_rad", "1"), ("valid", 1)):
        with pytest.raises(jsonschema_rs.ValidationError):
            check.validate({**value, name: [wrong] * n if name != "cycle" else wrong})


def test_each_field_has_a_single_plain_type_in_the_schema() -> None:
    # plotting viewers understand no list of types and no reference
    for one in cycle_schema(3)["properties"].values():
        inner = one["items"] if one["type"] == "array" else one
        assert inner["type"] in {"number", "integer", "boolean"}
