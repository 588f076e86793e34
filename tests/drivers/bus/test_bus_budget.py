"""The bus budget agrees with bit-stuffed frames and the simulated bus; its command reports it."""

import json
import re
from dataclasses import replace

import pytest
from cdpr_here import cdpr_here
from hypothesis import given, settings
from hypothesis import strategies as st

from cdpr_drivers.bus.budget import bare_bits, bus_budget, machine_budget, worst_case_bits
from cdpr_drivers.errors import ConfigurationError
from cdpr_drivers.robot.robot_buses import require_fit
from cdpr_profiles import load_drive, load_robot, load_winch
from cdpr_sim_bus.frame import SFF_BITS

DRIVE = load_drive("generic-cia402")
repeatable = settings(max_examples=100)
# after the CRC: its delimiter, acknowledge slot and delimiter, end of frame, interframe space
UNSTUFFED = 1 + 2 + 7 + 3


def bits_of(value: int, width: int) -> list[int]:
    return [value >> k & 1 for k in reversed(range(width))]


def crc15(bits: list[int]) -> int:
    """ISO 11898-1: x^15 + x^14 + x^10 + x^8 + x^7 + x^4 + x^3 + 1."""
    register = 0
    for bit in bits:
        register = (register << 1 & 0x7FFF) ^ (0x4599 if bit ^ register >> 14 else 0)
    return register


def stuff_bits(bits: list[int]) -> int:
    """Return the number of stuff bits: one opposite bit after each five equal bits."""
    sent: list[int] = []
    for bit in bits:
        sent.append(bit)
        if len(sent) >= 5 and len(set(sent[-5:])) == 1:
            sent.append(1 - bit)
    return len(sent) - len(bits)


def on_the_wire(identifier: int, data: bytes) -> int:
    """Return the length in bits of a base-format data frame, including the interframe space."""
    # start of frame, identifier, RTR, IDE, r0, DLC, data, CRC
    bits = [0, *bits_of(identifier, 11), 0, 0, 0, *bits_of(len(data), 4)]
    for byte in data:
        bits += bits_of(byte, 8)
    bits += bits_of(crc15(bits), 15)
    return len(bits) + stuff_bits(bits) + UNSTUFFED


def test_reference_crc_gives_known_values():
    # zeros leave the register empty, and a single 1 leaves the polynomial
    assert crc15([0] * 20) == 0
    assert crc15([0, 0, 1]) == 0x4599


identifiers = st.integers(0, 0x7FF)
# bytes with long runs of equal bits, which need stuff bits
runs = st.sampled_from([0x00, 0xFF, 0x0F, 0xF0, 0x1E, 0x3C, 0x78, 0x87, 0xC3, 0xE1])
payloads = st.binary(max_size=8) | st.lists(runs, max_size=8).map(bytes)


@repeatable
@given(identifiers, payloads)
def test_no_frame_is_longer_than_the_bound(identifier: int, data: bytes):
    n = len(data)
    assert bare_bits(n) <= on_the_wire(identifier, data) <= worst_case_bits(n)


@pytest.mark.parametrize("n", range(9))
def test_the_worst_bit_pattern_reaches_the_bound(n: int):
    """In 0 00001111 0000 1111 ... each stuff bit begins the next run."""
    m = 34 + 8 * n
    worst = [0] + [(k // 4) % 2 for k in range(m - 1)]
    assert bare_bits(n) + stuff_bits(worst) == worst_case_bits(n)


def test_frame_lengths_agree_with_the_simulated_bus():
    """Master and simulator compute them independently."""
    assert tuple(worst_case_bits(n) for n in range(9)) == SFF_BITS
    assert [worst_case_bits(n) for n in (0, 4, 6, 8)] == [55, 95, 115, 135]


def test_eight_drives_take_two_buses_at_1_kHz():
    eight = bus_budget("one", 1_000_000, 1e-3, [(node, DRIVE) for node in range(1, 9)])
    assert eight.cycle_s == pytest.approx(1895e-6)
    # statusword, controlword and torque have 16 bits, a position has 32
    assert eight.commands_s == pytest.approx(8 * 95e-6)
    assert eight.cycle_limit_Hz == pytest.approx(527.7, abs=0.05)
    assert not eight.fits
    assert "8 drives need 1895 us" in str(eight)
    four = machine_budget(load_robot("spatial-8"))
    assert [budget.cycle_s for budget in four] == pytest.approx([975e-6] * 2)
    assert all(budget.fits for budget in four)
    # 4 drives and the master each send 65 bits every 100 ms
    assert four[0].heartbeat_share == pytest.approx((4 * 65 / 0.1 + 65 / 0.1) * 1e-6)


@repeatable
@given(st.integers(1, 30), st.sampled_from([125_000, 500_000, 1_000_000]))
def test_the_highest_rate_just_fits(n: int, bitrate: int):
    drives = [(node, DRIVE) for node in range(1, n + 1)]
    highest = bus_budget("b", bitrate, 1e-2, drives).highest_rate_Hz
    at, above = (bus_budget("b", bitrate, 1 / (highest * f), drives) for f in (1.0, 1.001))
    assert at.fits
    assert at.margin_s == pytest.approx(0.0, abs=1e-9)
    assert not above.fits


def test_event_driven_frames_count_by_priority():
    first, second = DRIVE.tpdos
    below = second.model_copy(update={"cob_id_offset": 0x181, "transmission_type": 255})
    waits = bus_budget("b", 1_000_000, 1e-3, [(1, DRIVE)])
    pushes = bus_budget(
        "b", 1_000_000, 1e-3, [(1, DRIVE.model_copy(update={"tpdos": (first, below)}))]
    )
    assert pushes.cycle_s - waits.cycle_s == pytest.approx(worst_case_bits(7) * 1e-6)
    assert (waits.changes_s, pushes.changes_s) == (pytest.approx(125e-6), 0.0)


def test_a_machine_that_does_not_fit_is_rejected_with_its_highest_rate():
    robot = load_robot("spatial-8")
    require_fit(robot)
    with pytest.raises(
        ConfigurationError, match=r"bus can0: 4 drives need 975 us .* 500 us"
    ) as caught:
        require_fit(replace(robot, sync_period_s=0.0005))
    said = re.search(
        r"highest rate at 1000000 bit/s: 1022 Hz \(sync_period_s (\S+)\)", str(caught.value)
    )
    assert said is not None
    require_fit(replace(robot, sync_period_s=float(said[1])))
    with pytest.raises(ConfigurationError, match="1 drives need 5700 us"):
        require_fit(replace(load_winch("winch-mpp0923d"), bitrate_bit_s=50_000))


def run(*arguments: str) -> tuple[int, dict[str, object], str]:
    done = cdpr_here("bus", "budget", *arguments, "--json")
    return done.returncode, json.loads(done.stdout.splitlines()[-1]), done.stderr


def test_the_command_reports_the_budget_and_rejects_a_rate_that_does_not_fit():
    status, told, _ = run("spatial-8")
    assert (status, told["ok"]) == (0, True)
    assert [bus["cycle_us"] for bus in told["buses"]] == [975.0, 975.0]
    highest = told["buses"][0]["highest_rate_Hz"]
    assert run("spatial-8", "--rate", str(highest))[0] == 0
    status, told, errors = run("spatial-8", "--rate", str(highest + 1))
    assert (status, told["ok"], told["exit_status"]) == (2, False, 2)
    assert [bus["fits"] for bus in told["buses"]] == [False, False]
    assert "975 us" in errors
    assert "Traceback" not in errors
