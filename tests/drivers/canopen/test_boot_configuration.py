"""The configuration of a drive: its list of objects, its stamp in 1020h, and storing."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import pytest

from cdpr_drivers.canopen.boot import BootReport, boot
from cdpr_drivers.canopen.configuration import (
    Configuration,
    Stamp,
    make_configuration,
    matches,
    read_stamp,
)
from cdpr_drivers.canopen.network import CanNetwork
from cdpr_drivers.errors import BootError, DriverError
from cdpr_profiles import DriveProfile
from tests.drivers.axis_rig import DRIVE, MASTER, SETTINGS, dictionary, open_network


@pytest.fixture
def network(bus: str) -> Iterator[CanNetwork]:
    with open_network(bus, [1]) as opened:
        yield opened
        opened.write(1, 0x1011, 1, int.from_bytes(b"load", "little"))  # erase what is stored


def _wanted(profile: DriveProfile = DRIVE, **want: float) -> Configuration:
    return make_configuration(profile, dictionary(1), 1, replace(SETTINGS, **want), 3.0)


def _boot(network: CanNetwork, profile: DriveProfile = DRIVE, store: bool = False) -> BootReport:
    return boot(network, 1, profile, SETTINGS, store_configuration=store)


class _Requests:
    """Record SDO requests."""

    def __init__(self, network: CanNetwork, monkeypatch: pytest.MonkeyPatch) -> None:
        self.reads: list[tuple[int, int]] = []
        self.writes: list[tuple[int, int]] = []
        upload, download = network.clients[1].upload, network.clients[1].download

        def count_upload(index: int, sub: int, *args: float, **more: bool) -> bytes:
            self.reads.append((index, sub))
            return upload(index, sub, *args, **more)

        def count_download(index: int, sub: int, *args: object) -> None:
            self.writes.append((index, sub))
            download(index, sub, *args)  # type: ignore[arg-type]

        monkeypatch.setattr(network.clients[1], "upload", count_upload)
        monkeypatch.setattr(network.clients[1], "download", count_download)


# -- the list


def test_the_list_has_profile_and_settings_in_the_order_of_the_standard() -> None:
    wanted = _wanted()
    values = {(e.index, e.sub): e.value for e in wanted.entries}
    assert values[0x1006, 0] == 1000
    assert values[0x1016, 1] == MASTER << 16 | 500
    assert values[0x6072, 0] == 1000
    assert values[0x1A00, 0] == 3
    assert values[0x1A00, 2] == 0x60640020
    assert values[0x1402, 1] >> 31 == 1  # the profile has no RPDO3
    tpdo1 = [(e.index, e.sub) for e in wanted.entries if e.index in (0x1800, 0x1A00)]
    assert tpdo1[:2] == [(0x1800, 1), (0x1A00, 0)]
    assert tpdo1[-2:] == [(0x1A00, 0), (0x1800, 1)]
    assert tpdo1.index((0x1800, 2)) < tpdo1.index((0x1A00, 1))


def test_every_difference_changes_the_stamp() -> None:
    entry = DRIVE.tpdos[0].entries[2].model_copy(update={"index": 0x6078})
    tpdo = DRIVE.tpdos[0].model_copy(update={"entries": (*DRIVE.tpdos[0].entries[:2], entry)})
    others = [
        _wanted(sync_period_s=2e-3),
        _wanted(torque_limit_Nm=2.9),
        _wanted(master_node_id=126),
        _wanted(DRIVE.model_copy(update={"heartbeat_producer_s": 0.2})),
        _wanted(DRIVE.model_copy(update={"tpdos": (tpdo, DRIVE.tpdos[1])})),
    ]
    stamps = {configuration.stamp() for configuration in (_wanted(), *others)}
    assert len(stamps) == 6
    assert _wanted().stamp() == _wanted().stamp()
    assert all(0 < s.days <= 0xFFFF and 0 < s.ms < 86_400_000 for s in stamps)


def test_settings_invalid_by_the_eds_are_reported_before_anything_is_sent() -> None:
    tpdo = DRIVE.tpdos[0].model_copy(update={"number": 5})
    with pytest.raises(DriverError, match="1804h:1 is not in the drive's EDS"):
        _wanted(DRIVE.model_copy(update={"tpdos": (tpdo,)}))


def test_bits_of_a_cob_id_that_the_drive_sets_do_not_count_as_difference() -> None:
    enabled = [e for e in _wanted().entries if (e.index, e.sub) == (0x1800, 1)][-1]
    assert matches(enabled, 0x181)
    assert matches(enabled, 0x4000_0181)
    assert not matches(enabled, 0x8000_0181)
    assert not matches(enabled, 0x182)


# -- the stamp


def test_1020h_contains_the_stamp_after_a_download(network: CanNetwork) -> None:
    report = _boot(network)
    assert not report.stamp_matched
    assert not report.stored
    assert read_stamp(network, 1) == _wanted().stamp()
    assert network.read_int(1, 0x1A00, 0) == 3


def test_a_configuration_that_is_not_stored_is_compared_at_the_next_boot(
    network: CanNetwork,
) -> None:
    _boot(network)
    assert not _boot(network).stamp_matched


def test_a_stored_configuration_is_not_compared_again(
    network: CanNetwork, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = _boot(network, store=True)
    assert first.stored
    network.reset(1)
    assert network.read_int(1, 0x1001) == 0
    requests = _Requests(network, monkeypatch)
    again = _boot(network, store=True)
    assert again.stamp_matched
    assert not again.stored
    assert again.changed == []
    assert requests.writes == []
    assert not [key for key in requests.reads if 0x1400 <= key[0] < 0x1C00]
    # it is the wanted configuration
    assert network.read_int(1, 0x1017) == 100
    assert network.read_int(1, 0x1800, 1) & 0xBFFFFFFF == 0x181


def test_a_different_configuration_is_downloaded_and_the_changes_reported(
    network: CanNetwork,
) -> None:
    _boot(network, store=True)
    report = _boot(network, DRIVE.model_copy(update={"heartbeat_producer_s": 0.2}))
    assert not report.stamp_matched
    assert report.changed == ["1017h:0 = 200"]


def test_a_changed_limit_is_corrected_although_the_stamp_matches(network: CanNetwork) -> None:
    _boot(network)
    network.write(1, 0x6072, 0, 4000)
    stamp = _wanted().stamp()
    for sub, value in ((1, stamp.days), (2, stamp.ms)):
        network.write(1, 0x1020, sub, value)
    network.write(1, 0x1010, 2, int.from_bytes(b"save", "little"))
    report = _boot(network)
    assert report.stamp_matched
    assert report.changed == ["6072h:0 = 1000"]
    assert read_stamp(network, 1) == stamp


def test_a_drive_without_1020h_is_compared_at_each_boot(network: CanNetwork, bus: str) -> None:
    lean = dictionary(1)
    del lean[0x1020]
    network.add_node(1, lean)
    assert _boot(network, store=True).stored
    again = _boot(network)
    assert not again.stamp_matched
    assert again.changed == []


def test_a_drive_that_cannot_store_fails_step_j(
    network: CanNetwork, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "cdpr_drivers.canopen.configuration._SAVE", 0x12345678
    )  # a signature that the drive rejects
    with pytest.raises(BootError, match=r"step J.*stored.*1010h:1.*0800002") as caught:
        _boot(network, store=True)
    assert caught.value.letter == "J"


def test_read_stamp_returns_none_if_1020h_is_unused(network: CanNetwork) -> None:
    assert read_stamp(network, 1) is None
    network.write(1, 0x1020, 1, 5)
    assert read_stamp(network, 1) == Stamp(5, 0)


def test_a_fixed_identifier_that_differs_from_the_profile_is_rejected() -> None:
    objects = dictionary(1)
    objects[0x1400][1].access_type = "ro"
    assert make_configuration(DRIVE, objects, 1, SETTINGS, 3.0).entries
    moved = DRIVE.rpdos[0].model_copy(update={"cob_id_offset": 0x300})
    profile = DRIVE.model_copy(update={"rpdos": (moved,)})
    with pytest.raises(DriverError, match=r"1400h:1 cannot be written, .* is 201h; .* needs 301h"):
        make_configuration(profile, objects, 1, SETTINGS, 3.0)
