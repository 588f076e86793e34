"""Industrial cameras without hardware: a stand-in for harvesters, and genicam's test producer.

`FakeHarvester` has the names of the interface of harvesters 1.4, nothing more.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any, ClassVar, Self

import numpy as np
import pytest
from numpy.typing import NDArray

from cdpr_drivers.camera.camera import Camera, CameraError, open_camera
from cdpr_rt.core.clock import LockstepClock

RED, GREEN, BLUE = 200, 100, 20
GREY = 121
"""Grey level of the red, green and blue levels above, by ITU-R BT.601."""


def plain(*levels: int) -> NDArray[np.uint8]:
    return np.tile(np.array(levels, np.uint8), (6, 8, 1))


def mosaic(rows: tuple[tuple[int, int], tuple[int, int]]) -> NDArray[np.uint8]:
    return np.tile(np.array(rows, np.uint8), (3, 4))


class FakeHarvester:
    """A producer with the cameras in `serials`. The first one delivers `pixels`."""

    serials = ("77",)
    pixels: NDArray[Any] = plain(90)
    data_format = "Mono8"
    stamp_ns: int | None = 2_500_000_000
    fails: Exception | None = None
    incomplete = False
    open_fails: Exception | None = None
    triggered = True
    called: ClassVar[list[str]] = []

    def __init__(self) -> None:
        self.device_info_list: list[Any] = []

    def add_file(self, path: str) -> None:
        self.called.append(path)

    def update(self) -> None:
        self.device_info_list = [SimpleNamespace(serial_number=one) for one in self.serials]

    def create(self, wanted: Any) -> Any:
        self.called.append(f"create {wanted}")
        if self.open_fails:
            raise self.open_fails
        trigger = SimpleNamespace(execute=lambda: self.called.append("trigger"))
        names = ("TriggerSelector", "TriggerSource", "TriggerMode") if self.triggered else ()
        nodes = SimpleNamespace(
            TriggerSoftware=trigger, **{name: SimpleNamespace(value="") for name in names}
        )
        self.remote_device = SimpleNamespace(node_map=nodes)
        return self

    def start(self) -> None:
        self.called.append("start")

    def stop(self) -> None:
        self.called.append("stop")

    def destroy(self) -> None:
        self.called.append("destroy")

    def reset(self) -> None:
        self.called.append("reset")

    def queue(self) -> None:
        self.called.append("queue")

    def fetch(self, *, timeout: float) -> Any:
        assert 1.0 < timeout < 30.0
        if self.fails:
            raise self.fails
        return None if self.incomplete else self

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.queue()

    @property
    def payload(self) -> Any:
        height, width = self.pixels.shape[:2]
        component = SimpleNamespace(
            data=self.pixels.ravel(), data_format=self.data_format, height=height, width=width
        )
        return SimpleNamespace(components=[component])

    @property
    def timestamp_ns(self) -> int:
        if self.stamp_ns is None:
            raise RuntimeError("timestamps not supported by the device")
        return self.stamp_ns


@pytest.fixture
def harvester(monkeypatch: pytest.MonkeyPatch) -> Iterator[type[FakeHarvester]]:
    core: Any = ModuleType("harvesters.core")
    core.Harvester = type("Fake", (FakeHarvester,), {"called": []})
    monkeypatch.setitem(sys.modules, "harvesters", ModuleType("harvesters"))
    monkeypatch.setitem(sys.modules, "harvesters.core", core)
    monkeypatch.delitem(sys.modules, "cdpr_drivers.camera.genicam_camera", raising=False)
    yield core.Harvester
    sys.modules.pop("cdpr_drivers.camera.genicam_camera", None)


def opened(folder: Path, serial: str = "") -> Camera:
    producer = folder / "vendor.cti"
    producer.touch()
    return open_camera(f"genicam:{producer}{serial}", LockstepClock())


@pytest.mark.parametrize(
    ("data_format", "pixels", "grey"),
    [
        ("Mono8", plain(90), 90),
        ("RGB8", plain(RED, GREEN, BLUE), GREY),
        ("BGR8", plain(BLUE, GREEN, RED), GREY),
        ("RGBa8", plain(RED, GREEN, BLUE, 255), GREY),
        ("BayerRG8", mosaic(((RED, GREEN), (GREEN, BLUE))), GREY),
        ("BayerGR8", mosaic(((GREEN, RED), (BLUE, GREEN))), GREY),
        ("BayerGB8", mosaic(((GREEN, BLUE), (RED, GREEN))), GREY),
        ("BayerBG8", mosaic(((BLUE, GREEN), (GREEN, RED))), GREY),
    ],
)
def test_pixel_formats_become_grey_levels(
    tmp_path: Path,
    harvester: type[FakeHarvester],
    data_format: str,
    pixels: NDArray[np.uint8],
    grey: int,
) -> None:
    harvester.data_format, harvester.pixels = data_format, pixels
    with opened(tmp_path, "#77") as camera:
        image = camera.grab()
    assert image is not None
    assert image.pixels.shape == (6, 8) and image.device_time_s == 2.5
    assert abs(image.pixels.astype(int) - grey).max() <= 1
    ends = ["trigger", "queue", "stop", "destroy", "reset"]
    assert harvester.called[1:] == ["create {'serial_number': '77'}", "start", *ends]


def test_an_old_image_of_a_camera_without_trigger_is_discarded(
    tmp_path: Path, harvester: type[FakeHarvester]
) -> None:
    harvester.triggered, harvester.stamp_ns = False, None
    with opened(tmp_path) as camera:
        image = camera.grab()
    assert image is not None and image.device_time_s is None
    assert harvester.called.count("queue") == 2 and "trigger" not in harvester.called


@pytest.mark.parametrize(
    ("state", "said"),
    [
        ({"serials": ()}, "finds no camera; is it plugged in and powered"),
        ({"serials": ("12", "13")}, "no camera 77; allowed: 12, 13"),
        ({"open_fails": RuntimeError("access denied")}, "access denied; is it used by another"),
    ],
)
def test_a_camera_that_cannot_be_opened_is_reported_and_its_producer_released(
    tmp_path: Path, harvester: type[FakeHarvester], state: dict[str, Any], said: str
) -> None:
    for key, value in state.items():
        setattr(harvester, key, value)
    with pytest.raises(CameraError, match=said):
        opened(tmp_path, "#77")
    assert harvester.called[-1] == "reset"


@pytest.mark.parametrize(
    ("state", "said"),
    [
        ({"fails": TimeoutError()}, "no image: TimeoutError; is it unplugged"),
        ({"fails": RuntimeError("device lost")}, "no image: device lost; is it unplugged"),
        ({"incomplete": True}, "was incomplete; is the network overloaded"),
        ({"data_format": "YCbCr8"}, "PixelFormat YCbCr8 of uint8; allowed: Mono8"),
        (
            {"pixels": np.zeros((6, 8), np.uint16), "data_format": "Mono12"},
            "PixelFormat Mono12 of uint16; allowed: Mono8",
        ),
    ],
)
def test_a_missing_image_is_reported(
    tmp_path: Path, harvester: type[FakeHarvester], state: dict[str, Any], said: str
) -> None:
    with opened(tmp_path) as camera:
        for key, value in state.items():
            setattr(harvester, key, value)
        with pytest.raises(CameraError, match=said):
            camera.grab()


def test_an_incomplete_old_image_is_reported(
    tmp_path: Path, harvester: type[FakeHarvester]
) -> None:
    harvester.triggered, harvester.incomplete = False, True
    with (
        opened(tmp_path) as camera,
        pytest.raises(CameraError, match="was incomplete; is the network overloaded"),
    ):
        camera.grab()


def test_a_missing_producer_file_is_reported(harvester: type[FakeHarvester]) -> None:
    with pytest.raises(CameraError, match=r"no file /nowhere\.cti; it is the GenTL producer"):
        open_camera("genicam:/nowhere.cti", LockstepClock())


# This extra is not in the lock file: its binaries have a different licence and do not exist for
# each Python version. The tests above do not need it.
@pytest.mark.skipif(find_spec("genicam") is None, reason="needs cdpr-rt[genicam]")
def test_the_simulated_cameras_of_the_librarys_own_producer_give_images() -> None:
    folder = Path(str(importlib.import_module("genicam").__file__)).parent
    if not (folder / "viky.cti").is_file():
        pytest.skip("this version of genicam has no producer of its own")
    with open_camera(f"genicam:{folder / 'viky.cti'}#1", LockstepClock()) as camera:
        image = camera.grab()
    assert image is not None and image.pixels.shape == (400, 400)
