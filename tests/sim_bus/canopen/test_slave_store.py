"""1010h and 1011h store and restore parameters in a file."""

from __future__ import annotations

from pathlib import Path

import canopen
import pytest

from cdpr_sim_bus.canopen import ParameterStore, StoreError
from tests.sim_bus.canopen.slave_bench import NODE, Bench


def power_cycle(path: Path, node_id: int = NODE) -> Bench:
    return Bench(node_id=node_id, store=ParameterStore(path, volatile={0x6040})).boot()


def test_stored_values_survive_a_power_cycle_and_resets(tmp_path: Path) -> None:
    path = tmp_path / "drive.json"
    bench = power_cycle(path)
    bench.write(0x1017, 0, (750).to_bytes(2, "little"))
    bench.write(0x6072, 0, (555).to_bytes(2, "little"))
    bench.write(0x6040, 0, (6).to_bytes(2, "little"))
    bench.write(0x2F10, 0, b"\x00\xffdata")
    bench.configure_pdo(0x1400, [0x60FF0020, 0x60400010], 255)
    assert bench.read(0x1010, 1) == b"\x01\0\0\0"
    bench.write(0x1010, 1, b"save")
    bench.write(0x6072, 0, (1).to_bytes(2, "little"))
    bench.nmt(129)
    for device in (bench, power_cycle(path)):
        assert device.od.get(0x1017) == 750
        assert device.od.get(0x6072) == 555
        assert device.od.get(0x6040) == 0
        assert device.od.get(0x2F10) == b"\x00\xffdata"
        assert device.run_to(device.now + 0.75)[0][1] == 0x700 + NODE
        device.start()
        device.send(0x200 + NODE, bytes([7, 0, 0, 0, 8, 0]))
        assert (device.od.get(0x60FF), device.od.get(0x6040)) == (7, 8)


def test_stored_identifiers_follow_the_node_id(tmp_path: Path) -> None:
    path = tmp_path / "drive.json"
    power_cycle(path).write(0x1010, 1, b"save")
    other = power_cycle(path, node_id=9)
    assert other.read(0x1800, 1) == (0x189).to_bytes(4, "little")


def test_failed_storing_is_reported_as_hardware_error(tmp_path: Path) -> None:
    bench = power_cycle(tmp_path / "missing" / "drive.json")
    with pytest.raises(canopen.SdoAbortedError) as caught:
        bench.write(0x1010, 1, b"save")
    assert caught.value.code == 0x06060000


def test_storing_does_not_change_other_files_in_the_folder(tmp_path: Path) -> None:
    path, other = tmp_path / "drive.json", tmp_path / "drive.json.part"
    other.write_text("of the user")
    power_cycle(path).write(0x1010, 1, b"save")
    assert other.read_text() == "of the user"
    assert sorted(tmp_path.iterdir()) == [path, other]


@pytest.mark.parametrize(
    "content",
    ["", "[]", "{}", '{"values": {"zz": 1}, "node_id": 1, "bitrate": 1}', '{"values": 3}'],
)
def test_error_for_an_invalid_store_names_the_file(tmp_path: Path, content: str) -> None:
    path = tmp_path / "drive.json"
    path.write_text(content)
    with pytest.raises(StoreError, match=r"drive\.json"):
        ParameterStore(path)
