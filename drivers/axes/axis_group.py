"""A group of CiA 402 axes on one bus, exchanged once per cycle as arrays."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Self

import numpy as np

from cdpr_drivers.axes import axis_codec as codec
from cdpr_drivers.axes.axis_exchange import AxisExchange, has_deadline
from cdpr_drivers.axes.axis_layout import AxisConfig
from cdpr_drivers.axes.axis_state import NO_MODE
from cdpr_drivers.cia402 import HALT, POWER_OFF, TARGETS, State, mode_name, supports
from cdpr_drivers.errors import BusError, DriveFaultError, ModeRefusedError, SdoError
from cdpr_rt.arrays import BoolArray

__all__ = ["AxisConfig", "AxisGroup"]

_POWER_OFF_TIMEOUT_S = 1.0


class AxisGroup(AxisExchange):
    """n axes on one bus; implements `cdpr_rt.core.exchange.AxisDevice`.

    Used as a context manager it leaves the drives without power, however the block ends. Nothing
    is enabled that was not asked for with `request`, in a mode the drive has confirmed; a fault
    takes the request away and stays until `acknowledge_fault`. The arrays of `feedback` and
    `command` are overwritten in place and must not be exchanged for others.

    Raises BusError when the bus goes away, and DriverError for a PDO map that does not serve torque
    control.
    """

    # -- between cycles

    def stop_cycling(self) -> None:
        """End the cycles for a while; the network goes on with the master's heartbeat.

        Drives that watch for late RPDOs wait in pre-operational. Raises DriveFaultError when an
        axis is still asked to be enabled.
        """
        if np.any(self._ints[codec.TARGET] == State.OPERATION_ENABLED):
            raise DriveFaultError("cycles may only stop once the drives have been disabled")
        for axis in self.axes:
            if self._cycling and has_deadline(axis):
                self.network.stop_process_data(axis.node_id)
        self._end_cycling()

    def tolerate_silence(self, cycles: int) -> None:
        """Bridge so many consecutive cycles without an answer; in lockstep none is bridged."""
        if not self.lockstep:
            self._ints[codec.SILENCE_LIMIT] = cycles + 1

    def request(self, state: State) -> None:
        """Ask all axes for a state; the cycles lead them there step by step.

        Raises ValueError for a state that cannot be asked for, DriveFaultError for enabling a
        drive whose fault was not acknowledged, ModeRefusedError for enabling one whose mode is
        not confirmed.
        """
        if state not in TARGETS:
            raise ValueError(f"{state.label} cannot be asked for")
        if state == State.OPERATION_ENABLED:
            for axis, faulted in zip(self.axes, self.faulted(), strict=True):
                if faulted:
                    raise DriveFaultError(f"{axis.label}: acknowledge its fault before enabling it")
            if not self.mode_confirmed():
                raise self.unconfirmed_mode()
        self._ints[codec.TARGET] = state

    def reached(self, state: State) -> bool:
        """Return whether all axes report `state`."""
        return bool(np.all(self._ints[codec.STATE] == state))

    def states(self) -> list[State]:
        """Return the state each axis reported last."""
        return [State(int(s)) for s in self._ints[codec.STATE]]

    def faulted(self) -> BoolArray:
        """Return which axes have been in fault since the last acknowledgement, (n,)."""
        return np.asarray(self._ints[codec.FAULTED] != 0)

    def acknowledge_fault(self) -> None:
        """Forget latched alarms; drives in fault get a fault reset with the next cycles.

        Nothing is enabled by this. A drive that stays in fault raises the alarm again after its
        `state_timeout_s`.
        """
        ints = self._ints
        for i, axis in enumerate(self.axes):
            if ints[codec.STATE, i] in (State.FAULT, State.FAULT_REACTION):
                cycles = round(axis.drive.state_timeout_s / self.period_s)
                ints[codec.ACKNOWLEDGE, i] = max(3, cycles)
        ints[codec.TARGET] = State.SWITCH_ON_DISABLED
        ints[codec.FAULTED] = 0
        ints[codec.ALARM] = 0
        ints[codec.SILENT_CYCLES] = 0
        ints[codec.HEARTBEAT_AGE] = 0
        self._forget_irregularities()
        self._alarms = 0
        self.network.clear_alarm()

    def set_extra_bits(self, axis: int, bits: int) -> None:
        """Add mode-specific bits to an enabled axis' controlword (start of homing, halt)."""
        self._ints[codec.EXTRA_BITS, axis] = bits

    # -- modes of operation

    @property
    def torque_modes(self) -> list[int]:
        """The mode in which each axis' drive takes torques, for `ask_mode`."""
        return [axis.drive.mode_torque for axis in self.axes]

    def ask_mode(self, modes: int | Sequence[int]) -> None:
        """Ask for a mode of operation, one for all axes or one each.

        `mode_confirmed` tells when they have it. Raises ModeRefusedError when an axis is enabled
        or lacks its mode, which leaves all as they were, or when a drive refuses, with its
        reason; then no axis is enabled before it was asked for a mode again.
        """
        requested = [modes] * self.n if isinstance(modes, int) else list(modes)
        for i, (axis, mode) in enumerate(zip(self.axes, requested, strict=True)):
            if self._ints[codec.STATE, i] == State.OPERATION_ENABLED:
                raise ModeRefusedError(
                    f"{axis.label}: the mode is not changed while the drive is enabled"
                )
            if not supports(axis.supported_modes, mode):
                raise ModeRefusedError(
                    f"{axis.label}: mode {mode_name(mode)} is not among the modes "
                    f"the drive supports (6502h = {axis.supported_modes:08X}h)"
                )
        self._ints[codec.MODE_REQUESTED] = NO_MODE
        for i, mode in enumerate(requested):
            self._write_mode(i, mode)
        self._ints[codec.MODE_REQUESTED] = requested

    def _write_mode(self, i: int, mode: int) -> None:
        node = self.axes[i].node_id
        try:
            if self.axes[i].drive.quirks.halt_before_mode_change:
                # until the next cycle's controlword takes the halt back
                self.network.write(node, 0x6040, 0, HALT)
            self.network.write(node, 0x6060, 0, mode)
            self._ints[codec.MODE_DISPLAYED, i] = self.network.read_int(node, 0x6061)
        except SdoError as error:
            raise ModeRefusedError(
                f"{self.axes[i].label}: mode {mode_name(mode)} was refused: {error}"
            ) from error

    def mode_confirmed(self) -> bool:
        """Return whether every axis reports the mode it was asked for (6061h).

        Raises SdoError when a drive whose PDOs do not tell the mode cannot be asked.
        """
        for i in np.flatnonzero(~self._layout.mode_mapped):
            displayed = self.network.read_int(self.axes[i].node_id, 0x6061)
            self._ints[codec.MODE_DISPLAYED, i] = displayed
        return bool(np.all(self._ints[codec.MODE_DISPLAYED] == self._ints[codec.MODE_REQUESTED]))

    def unconfirmed_mode(self) -> ModeRefusedError:
        """Return the error that names the first axis whose mode is not what was asked for."""
        displayed, requested = self._ints[codec.MODE_DISPLAYED], self._ints[codec.MODE_REQUESTED]
        i = int(np.flatnonzero(displayed != requested)[0])
        label = self.axes[i].label
        if requested[i] == NO_MODE:
            return ModeRefusedError(
                f"{label}: no mode of operation was asked for yet, or the last was refused"
            )
        return ModeRefusedError(
            f"{label}: asked for mode {mode_name(int(requested[i]))}, "
            f"but the drive reports {mode_name(int(displayed[i]))} (6061h); it was not enabled"
        )

    # -- the encoder index

    def set_index(self, axis: int, position_rad: float) -> None:
        """Note where the encoder index of an axis lies, after its drive has set a new origin."""
        ints = self._ints
        ints[codec.POSITION, axis] = ints[codec.LAST_RAW_POSITION, axis]
        self.feedback.index_rad[axis] = position_rad
        self.feedback.index_known[axis] = True

    def reports_probe(self, axis: int) -> bool:
        """Whether the drive's PDOs carry touch probe status and position."""
        return bool(self._layout.probe_mapped[axis])

    def expect_index(self, axis: int, armed: bool) -> None:
        """Take the next latched touch probe position of an axis for its index, or no longer.

        Raises DriverError when the drive's PDOs do not carry touch probe status and position.
        """
        if armed and not self.reports_probe(axis):
            raise DriveFaultError(
                f"drive profile {self.axes[axis].drive.name!r}: tpdos: no TPDO holds both 60B9h "
                "and 60BAh, which finding the index by touch probe needs"
            )
        if armed:
            self._ints[codec.PROBE_STATUS, axis] = 0
            self.feedback.index_known[axis] = False
        self._ints[codec.PROBE_ARMED, axis] = armed

    # -- the end

    def close(self) -> str:
        """Take torque and power from the drives and end the cycles; a second time does nothing.

        First by the cycle; a drive that does not follow is commanded by SDO, and as the last resort
        reset. Returns which drives have not confirmed that their power stage is off, else an empty
        text. A bus that has gone away is no error here: its drives miss the master's heartbeat and
        stop.
        """
        if self._closed:
            return ""
        self._closed = True
        try:
            return self._switch_off()
        finally:
            self._end_cycling()

    def _switch_off(self) -> str:
        self._ints[codec.EXTRA_BITS] = 0
        try:
            if self._switch_off_by_cycles():
                return ""
            left = [a.label for a in self.axes if not self.network.switch_off(a.node_id)]
        except BusError as error:
            nodes = ", ".join(axis.label for axis in self.axes)
            return f"{nodes}: not known to be without power: {error}"
        if not left:
            return ""
        return (
            f"{', '.join(left)}: does not confirm that its power stage is off; it was reset (NMT), "
            "but see to it that it has no power"
        )

    def _switch_off_by_cycles(self) -> bool:
        """Run cycles with zero torque; return whether every drive reports its power stage off."""
        clock = self.clock
        until_s = clock.now_s + _POWER_OFF_TIMEOUT_S
        self.request(State.SWITCH_ON_DISABLED)
        while clock.now_s < until_s:
            self.command.torque_Nm[:] = 0.0
            self.sync()
            answered = self.receive()
            self.transmit()
            if answered == self.n and all(state in POWER_OFF for state in self.states()):
                return True
            if self.lockstep:
                self.let_other_buses_follow()
            else:
                clock.sleep(self.period_s)
        return False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, _kind: object, error: BaseException | None, _trace: object) -> None:
        unconfirmed = self.close()
        if not unconfirmed:
            return
        if error is None:
            raise DriveFaultError(unconfirmed)
        error.add_note(unconfirmed)
