"""What further poses are said to bring, beside a fit that has them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cdpr_rt.calibration.estimation.fit import fit
from cdpr_rt.calibration.verification.more_poses import with_more_poses
from tests.cdpr_rt.calibration.made_up import made_up, measured


def test_it_is_what_a_fit_comes_to_that_has_every_pose_twice() -> None:
    what = made_up("spatial-8", 30, 3)
    seen = measured(what, 1e-3, 1e-3, 3)
    found, twice = fit(what.file, seen), fit(what.file, seen.some(np.tile(np.arange(30), 2)))
    told = np.sqrt(np.diag(with_more_poses(found, 30).covariance))
    by_noise = np.sqrt(np.diag(twice.covariance))
    truly = by_noise * np.sqrt(found.variance_factor / max(twice.variance_factor, 1.0))
    if found.variance_factor < 1.0:
        truly = by_noise / np.sqrt(max(twice.variance_factor, 1.0))
    np.testing.assert_allclose(told, truly, rtol=0.02)
    assert (told < found.std).all()


def test_what_nothing_tells_stays_as_it_was_known() -> None:
    what = made_up("spatial-8", 30, 3)
    found = fit(what.file, what.seen)
    before = what.file.known_std() ** 2
    held = replace(found, covariance=np.diag(before), variance_factor=1.0)
    assert np.diag(with_more_poses(held, 1000).covariance) == pytest.approx(before)
