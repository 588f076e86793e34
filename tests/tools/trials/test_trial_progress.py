"""The progress of a trial."""

from __future__ import annotations

from pathlib import Path

import pytest

from cdpr_tools.trials.run import trial_run


def test_progress_starts_with_the_trial_and_never_decreases(tmp_path: Path) -> None:
    told: list[float] = []
    with trial_run("planar-3", tmp_path / "run", plant=None, seed=1, advance=told.append) as run:
        assert told and set(told) == {0.0}
        run.stay(0.1)
        assert told[-1] == pytest.approx(0.1)
    assert told == sorted(told)
