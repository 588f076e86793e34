"""Property tests draw the same examples regardless of the modules that are loaded."""

from __future__ import annotations

import importlib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st


def examples_of_a_property_test() -> list[tuple[float, int]]:
    examples = []

    @given(st.floats(0.0, 1e9), st.integers(0, 10**9))
    def draw(number: float, whole: int) -> None:
        examples.append((number, whole))

    draw()
    return examples


def test_loading_a_module_does_not_change_the_examples(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = examples_of_a_property_test()
    numbers = [*range(123_456_000, 123_456_200), *(k + 0.123 for k in range(777_000, 777_200))]
    (tmp_path / "full_of_numbers.py").write_text(f"NUMBERS = {numbers}\n")
    monkeypatch.syspath_prepend(tmp_path)
    importlib.import_module("full_of_numbers")
    assert len(before) == 100
    assert examples_of_a_property_test() == before
