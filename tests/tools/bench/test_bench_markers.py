"""`cdpr bench markers` tells errors against the truth; times belong to a machine."""

from __future__ import annotations

import pytest

from cdpr_sim_bus.camera.camera_plant import CameraPlant, GridPlant, LensPlant
from cdpr_tools.bench import markers as bench
from cdpr_tools.output import Output

SMALL = CameraPlant(
    samples=8,
    lens=LensPlant(width_px=480, height_px=384, focal_px=(415.0, 416.0), centre_px=(242.0, 189.0)),
    grids=(GridPlant(rows=4, columns=4),),
)


def test_maps_are_near_the_truth_and_nearer_with_our_corners(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(bench, "CameraPlant", lambda seed: SMALL)
    figures = bench.measure(10, 3, Output(as_json=True))
    ours, theirs = figures["ours"], figures["opencv"]
    assert ours["markers"] > 10
    assert ours["shape_rms_mm"] < 3.0
    assert ours["corner_sigma_px"] < 0.5 * theirs["corner_sigma_px"]
    assert "detection and map wanted within 20 s" in bench.report(figures)[-1]
