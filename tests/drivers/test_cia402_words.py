"""States and controlwords agree with the tables of the `canopen` package and the standard."""

from __future__ import annotations

import pytest
from canopen.profiles.p402 import State402

from cdpr_drivers.cia402 import CONTROLWORD_TABLE, TARGETS, State, fault_text, state_of, supports

S = State
_NAMES = {
    "NOT READY TO SWITCH ON": S.NOT_READY,
    "SWITCH ON DISABLED": S.SWITCH_ON_DISABLED,
    "READY TO SWITCH ON": S.READY,
    "SWITCHED ON": S.SWITCHED_ON,
    "OPERATION ENABLED": S.OPERATION_ENABLED,
    "FAULT": S.FAULT,
    "FAULT REACTION ACTIVE": S.FAULT_REACTION,
    "QUICK STOP ACTIVE": S.QUICK_STOP,
}


def test_each_statusword_is_decoded_as_by_the_canopen_package() -> None:
    for word in range(1 << 16):
        theirs = [
            _NAMES[n] for n, (mask, value) in State402.SW_MASK.items() if word & mask == value
        ]
        assert state_of(word) == (theirs[0] if theirs else S.UNKNOWN), f"{word:04X}"


# CiA 402-2, commands in the low four bits of the controlword: (mask, value, from, to)
_COMMANDS = (
    (0x02, 0x00, {S.READY, S.SWITCHED_ON, S.OPERATION_ENABLED, S.QUICK_STOP}, S.SWITCH_ON_DISABLED),
    (0x06, 0x02, {S.READY, S.SWITCHED_ON}, S.SWITCH_ON_DISABLED),
    (0x06, 0x02, {S.OPERATION_ENABLED}, S.QUICK_STOP),
    (0x07, 0x06, {S.SWITCH_ON_DISABLED, S.SWITCHED_ON, S.OPERATION_ENABLED}, S.READY),
    (0x07, 0x07, {S.READY}, S.SWITCHED_ON),
    (0x0F, 0x07, {S.OPERATION_ENABLED}, S.SWITCHED_ON),
    (0x0F, 0x0F, {S.SWITCHED_ON, S.QUICK_STOP}, S.OPERATION_ENABLED),
)


def _drive(state: State, word: int) -> State:
    """Return the state of a drive after a controlword."""
    for mask, value, sources, to in _COMMANDS:
        if word & mask == value and state in sources:
            return to
    return state


@pytest.mark.parametrize("target", TARGETS, ids=lambda s: s.name)
@pytest.mark.parametrize("start", TARGETS, ids=lambda s: s.name)
def test_controlwords_lead_from_each_state_to_the_target_without_enabling(
    start: State, target: State
) -> None:
    if target == S.QUICK_STOP and start != S.OPERATION_ENABLED:
        wanted = S.QUICK_STOP if start == S.QUICK_STOP else S.SWITCH_ON_DISABLED
    else:
        wanted = target
    state = start
    for _ in range(6):
        before = state
        state = _drive(state, int(CONTROLWORD_TABLE[target, state]))
        if S.OPERATION_ENABLED not in (target, before):
            assert state != S.OPERATION_ENABLED
    assert state == wanted


def test_no_controlword_in_a_fault_has_the_reset_bit() -> None:
    assert not (CONTROLWORD_TABLE & 0x80).any()
    for target in TARGETS:
        assert CONTROLWORD_TABLE[target, S.FAULT] == 0


def test_supported_modes_follow_6502h() -> None:
    assert supports(1 << 9, 10)
    assert not supports(1 << 9, 4)
    assert supports(1 << 5, 6)
    assert not supports(0xFFFFFFFF, 5)
    assert supports(0, -3)


def test_an_unlisted_fault_code_is_described_by_its_group() -> None:
    assert fault_text(0x8611) == "8611h following error"
    assert "current" in fault_text(0x2399)
    assert fault_text(0x81FF).startswith("81FFh communication")
