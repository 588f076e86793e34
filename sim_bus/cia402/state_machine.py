"""State machine of CiA 402: controlword, modes, stop ramps, faults, statusword."""

from __future__ import annotations

import math
from typing import Any

from cdpr_sim_bus.canopen.abort import Abort, SdoAbort
from cdpr_sim_bus.canopen.node import CanopenSlave
from cdpr_sim_bus.canopen.od import Value
from cdpr_sim_bus.cia402 import modes
from cdpr_sim_bus.cia402.axis import Axis
from cdpr_sim_bus.cia402.modes import Homing, Mode
from cdpr_sim_bus.cia402.words import (
    ALWAYS_WATCHED,
    FAULT_RESET,
    FAULTS,
    HALT,
    INTERNAL_LIMIT,
    LASTING,
    REMOTE,
    TARGET_REACHED,
    VOLTAGE_ENABLED,
    WARNING,
    ErrorCode,
    ModeNumber,
    State,
    error_register_bits,
)
from cdpr_sim_bus.robot import servo

BOOT_S = 0.002
"""Time from power-up until the drive can be switched on."""
_REACTION_LIMIT_S = 2.0
"""Time after which a fault reaction ends even if the motor is not at rest."""
_COASTING = (
    State.NOT_READY_TO_SWITCH_ON,
    State.SWITCH_ON_DISABLED,
    State.READY_TO_SWITCH_ON,
    State.SWITCHED_ON,
    State.FAULT,
)


class StateMachine:
    """State machine of one drive.

    `command` is the hook of the controlword; `tick` follows every step of the axis for which
    `needs_tick` returns true. Both write the statusword to the dictionary.
    """

    def __init__(self, axis: Axis, slave: CanopenSlave) -> None:
        od = axis.od
        self.axis = axis
        self.state = State.NOT_READY_TO_SWITCH_ON
        self.homing = Homing(axis)
        self._modes: dict[int, Mode] = {
            mode.number: mode
            for mode in (
                Mode(axis),
                modes.ProfilePosition(axis),
                modes.ProfileVelocity(axis),
                modes.ProfileTorque(axis),
                self.homing,
                modes.CyclicPosition(axis),
                modes.CyclicVelocity(axis),
                modes.CyclicTorque(axis),
            )
        }
        self.mode = self._modes[ModeNumber.NONE]
        self.ignore_modes = 0
        """Fault injection: 1 rejects every mode change, 2 accepts it but never changes the mode."""
        self.displayed_mode = 0
        """Fault injection: mode displayed instead of the real one; 0 for none."""
        self.configuration_changed = True
        """Whether limits, windows or ramps of the dictionary have changed."""
        self.ignores_commands = False
        """Fault injection: whether the controlword has no effect."""
        self.power_allowed = True
        """Whether the power stage may be on."""
        self.power_input = True
        """Whether the safe-torque-off input enables it."""
        self._power_lost = False
        self._slave = slave
        self._quirks = axis.quirks
        plant = axis.plant.drive
        self._mode_delay_s = max(plant.mode_display_delay_s, axis.quirks.mode_display_delay_s)
        self._enable_delay_s = max(plant.enable_delay_s, axis.quirks.enable_delay_s)
        self._status = od.entry(0x6041)
        self._display = od.entry(0x6061)
        self._error = od.entry(0x603F)
        self._supported = axis.quirks.supported_modes(od.get_int(0x6502))
        self.restart()
        od.on_write(0x6040, 0, self._receive_command)
        od.on_write(0x6060, 0, self.request_mode)

    def restart(self) -> None:
        """Restart as at power-up."""
        self.word = 0
        self._halted = False
        self._stop_to: State | None = None
        self._fault_code = 0
        self._boot_due = self.axis.time + BOOT_S
        self._enable_due = self._mode_due = self._reaction_due = math.inf
        self._last_flags = 0
        self.state = State.NOT_READY_TO_SWITCH_ON
        self.homing.forget()
        self.axis.reboot()
        requested = self.axis.object(0x6060)
        self._requested_mode = requested if requested in self._supported else 0
        self.mode = self._modes[self._requested_mode]
        self._error.value = 0
        self.configuration_changed = True
        self.update()

    # -- controlword

    def command(self, value: Value) -> None:
        """Process a controlword."""
        word: Any = value
        if word == self.word:
            return
        old, self.word = self.word, word
        if self.state is State.FAULT and word & ~old & FAULT_RESET:
            self._reset_fault()
        self._transition(word)
        if self.state is State.OPERATION_ENABLED and self._stop_to is None:
            self._halt(bool(word & HALT))
            if not self._halted:
                self.mode.command(old, word)
        self.update()

    def _receive_command(self, value: Value) -> None:
        if not self.ignores_commands:
            self.command(value)

    def _transition(self, word: int) -> None:
        """Make the transitions that a controlword commands in the present state."""
        self._enable_due = math.inf
        if word & 0x82 == 0x00:
            self._disable_voltage()
        elif word & 0x86 == 0x02:
            self._quick_stop()
        elif word & 0x87 == 0x06:
            self._shut_down()
        elif word & 0x8F == 0x07:
            self._switch_on()
        elif word & 0x8F == 0x0F:
            self._enable_operation()

    def _disable_voltage(self) -> None:
        if self.state in (
            State.READY_TO_SWITCH_ON,
            State.SWITCHED_ON,
            State.OPERATION_ENABLED,
            State.QUICK_STOP_ACTIVE,
        ):
            self._enter(State.SWITCH_ON_DISABLED)

    def _quick_stop(self) -> None:
        if self.state in (State.READY_TO_SWITCH_ON, State.SWITCHED_ON):
            self._enter(State.SWITCH_ON_DISABLED)
        elif self.state is State.OPERATION_ENABLED:
            option = self.axis.object(0x605A)
            if option == 0:
                self._enter(State.SWITCH_ON_DISABLED)
                return
            self.state = State.QUICK_STOP_ACTIVE
            stays = option >= 5
            self._brake(option - 4 if stays else option)
            self._end_stop(None if stays else State.SWITCH_ON_DISABLED)

    def _shut_down(self) -> None:
        if self.state is State.SWITCH_ON_DISABLED and not self.power_allowed:
            return
        if self.state in (State.SWITCH_ON_DISABLED, State.SWITCHED_ON):
            self._enter(State.READY_TO_SWITCH_ON)
        elif self.state is State.OPERATION_ENABLED:
            self._leave_operation(0x605B, State.READY_TO_SWITCH_ON)

    def _switch_on(self) -> None:
        if self.state is State.READY_TO_SWITCH_ON:
            self._enter(State.SWITCHED_ON)
        elif self.state is State.OPERATION_ENABLED:
            self._leave_operation(0x605C, State.SWITCHED_ON)

    def _enable_operation(self) -> None:
        if self.state is State.READY_TO_SWITCH_ON:
            self._enter(State.SWITCHED_ON)
        if self.state is State.SWITCHED_ON:
            self._enable_due = self.axis.time + self._enable_delay_s
            if self._enable_delay_s == 0.0:
                self._enable()
        elif self.state is State.QUICK_STOP_ACTIVE:
            if self.axis.object(0x605A) >= 5:
                self._enable()
        elif self.state is State.OPERATION_ENABLED and self._stop_to is not None:
            self._stop_to = None
            self.mode.resume()

    def _leave_operation(self, option_object: int, state: State) -> None:
        if self.axis.object(option_object) == 0:
            self._enter(state)
        else:
            self._end_stop(state)
            self._brake(1)

    def _enable(self) -> None:
        self._enable_due = math.inf
        self._stop_to = None
        self._halted = False
        self.state = State.OPERATION_ENABLED
        self.mode.start()
        self._halt(bool(self.word & HALT))

    def _enter(self, state: State) -> None:
        self.state = state
        self._stop_to = None
        self._reaction_due = math.inf
        if state in _COASTING:
            self._halted = False
            self.axis.switch_off()

    def _end_stop(self, state: State | None) -> None:
        """Enter a state when the motor rests, or when that takes too long."""
        self._stop_to = state
        self._reaction_due = self.axis.time + _REACTION_LIMIT_S

    def _halt(self, halt: bool) -> None:
        if halt == self._halted:
            return
        self._halted = halt
        if halt:
            self._brake(self.axis.object(0x605D))
        else:
            self.mode.resume()

    def _brake(self, option: int) -> None:
        """Brake to rest: option 1 slow-down ramp, 2 quick-stop ramp, 3 and 4 at the limit."""
        axis = self.axis
        if option == 1 and self.mode.torque_mode:
            axis.set_torque_slope(axis.object(0x6087))
            axis.drive(servo.TORQUE, 0.0)
            return
        if option == 1:
            ramp = axis.velocity(self.mode.ramp)
            axis.set_ramps(ramp, ramp)
        elif option == 2:
            axis.set_ramps(axis.velocity(0x6085), axis.velocity(0x6085))
        else:
            axis.set_steps()
        axis.motor["torque_offset"] = 0.0
        axis.drive(servo.VELOCITY, 0.0)

    # -- modes

    def request_mode(self, value: Value) -> None:
        """Request a mode of operation; raises SdoAbort if the drive does not support it."""
        number: Any = value
        if number == self._requested_mode:
            return
        if number not in self._supported or self.ignore_modes == 1:
            raise SdoAbort(Abort.INVALID_VALUE)
        enabled, halted = self.state is State.OPERATION_ENABLED, bool(self.word & HALT)
        if self._quirks.accepts_mode(enabled, halted) and self.ignore_modes == 0:
            self._requested_mode = number
            self._mode_due = self.axis.time + self._mode_delay_s
            self._pending = True

    def _change_mode(self) -> None:
        self._mode_due = math.inf
        self.mode = self._modes[self._requested_mode]
        if self.state is State.OPERATION_ENABLED and self._stop_to is None:
            self._halted = False
            self.mode.start()
            self._halt(bool(self.word & HALT))

    # -- faults

    def trip(self, code: int, *, severe: bool = False) -> None:
        """Raise a fault; a severe one cuts the power immediately, regardless of 605Eh."""
        if self.state in (State.FAULT, State.FAULT_REACTION_ACTIVE):
            return
        self._fault_code = code
        self._error.value = code
        option = self.axis.object(0x605E)
        if severe or option == 0 or self.axis.kind == servo.OFF:
            self._enter(State.FAULT)
        else:
            self.state = State.FAULT_REACTION_ACTIVE
            self._brake(option)
            self._end_stop(State.FAULT)
        self._slave.emergency(code, error_register_bits(code))
        self.update()

    def abort_connection(self, code: int) -> None:
        """React to a lost master as 6007h specifies, while operation is enabled."""
        if self.state is not State.OPERATION_ENABLED:
            return
        option = self.axis.object(0x6007)
        if option == 1:
            self.trip(code)
        elif option in (2, 3):
            self.command(0x0000 if option == 2 else 0x0002)

    def allow_power(self, allowed: bool) -> None:
        """Follow the safe-torque-off input: if it removes the power, the torque is off immediately.

        Without power, an enabled drive goes to fault, and any other drive cannot become ready.
        """
        self.power_input = allowed
        self.power_allowed = allowed = allowed and not self._power_lost
        if allowed:
            self._transition(self.word)
        elif self.state in (State.READY_TO_SWITCH_ON, State.SWITCHED_ON):
            self._enable_due = math.inf
            self._enter(State.SWITCH_ON_DISABLED)
        elif self.state is State.FAULT_REACTION_ACTIVE:
            self._enter(State.FAULT)
        elif self.axis.kind != servo.OFF:
            self.trip(ErrorCode.CONTACTOR, severe=True)
        self.update()

    def lose_power(self, lost: bool) -> None:
        """Fault injection: lose the supply of the power stage, or get it back."""
        self._power_lost = lost
        self.allow_power(self.power_input)

    def _reset_fault(self) -> None:
        if self.axis.flags & LASTING:
            return
        self._enter(State.SWITCH_ON_DISABLED)
        self._error.value = 0
        self._slave.emergency_clear(self._fault_code)

    # -- time

    def needs_tick(self, flags: int) -> bool:
        """Whether a step that ended with these flags concerns the state machine."""
        return (
            flags & self._watch != self._last_flags
            or self.configuration_changed
            or self._stop_to is not None
            or self._pending
        )

    def tick(self) -> None:
        """Evaluate the step that has just ended."""
        if self.configuration_changed:
            self._reconfigure()
        now, flags = self.axis.time + 1e-9, self.axis.flags
        if now >= self._boot_due:
            self._boot_due = math.inf
            self._enter(State.SWITCH_ON_DISABLED)
            self._transition(self.word)
        if now >= self._mode_due:
            self._change_mode()
        if now >= self._enable_due:
            self._enable()
        if self.axis.kind != servo.OFF:
            for flag, code, severe in FAULTS:
                if flags & flag:
                    self.trip(code, severe=severe)
        if self._stop_to is not None and (self._at_rest() or now >= self._reaction_due):
            self._enter(self._stop_to)
        elif self._running:
            self.mode.tick()
        self.update()

    def _reconfigure(self) -> None:
        self.configuration_changed = False
        self.axis.configure()
        if self._running:
            self.mode.reconfigure()

    def _at_rest(self) -> bool:
        flags = self.axis.flags
        if self.axis.kind == servo.TORQUE:
            return bool(flags & servo.REFERENCE_DONE)
        both = servo.REFERENCE_DONE | servo.STANDSTILL
        return flags & both == both

    def sync(self) -> None:
        """Apply the set-points of a new cycle, if the mode is a cyclic one."""
        if self.mode.cyclic and self._running:
            self.mode.sync()

    @property
    def _running(self) -> bool:
        return self.state is State.OPERATION_ENABLED and self._stop_to is None and not self._halted

    def update(self) -> None:
        """Set statusword and mode display, and the flags to watch for in the next steps."""
        flags = self.axis.flags
        word = self.state | REMOTE | (VOLTAGE_ENABLED if self.power_allowed else 0)
        if flags & servo.I2T_WARNING:
            word |= WARNING
        self._watch = ALWAYS_WATCHED
        if self.state is State.OPERATION_ENABLED:
            word |= self._operation_bits(flags)
            self._watch |= self.mode.watch | servo.LIMITED
            if self._halted:
                self._watch |= servo.STANDSTILL
        else:
            word |= self.mode.idle_status()
        self._last_flags = flags & self._watch
        self._pending = min(self._boot_due, self._mode_due, self._enable_due) < math.inf or (
            self._running and self.mode.busy
        )
        self._status.value = (word | self._quirks.statusword_set) & ~self._quirks.statusword_clear
        self._display.value = self.displayed_mode or self.mode.number.value

    def _operation_bits(self, flags: int) -> int:
        limit = INTERNAL_LIMIT if flags & servo.LIMITED or self.axis.clipped else 0
        if self._halted:
            at_rest = TARGET_REACHED if flags & servo.STANDSTILL else 0
            return self.mode.status() & ~TARGET_REACHED | limit | at_rest
        return self.mode.status() | limit
