"""A safety I/O polled beside the cycle: trips on its inputs, and on missing polls."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Final, Self

from cdpr_drivers.errors import DriverError
from cdpr_drivers.modbus.io_link import IoLink
from cdpr_drivers.modbus.io_rules import IoState, Rules, interpret
from cdpr_drivers.modbus.tcp import ModbusError
from cdpr_profiles.devices.safety_io import Brake, SafetyIoProfile
from cdpr_rt.core.clock import Clock
from cdpr_rt.core.task import Task
from cdpr_rt.state_file import StateFileError, read_state, remove_state, write_state

_STOP_GRACE_S: Final = 2.0
"""Longest time that a controlled stop may take before power is taken all the same."""
_STATE_COLOURS: Final = ("red", "yellow", "green")


class SafetyIoError(DriverError):
    """The safety I/O forbids a request or did not carry it out; names the point and its value."""


class SafetyIo:
    """One safety I/O; implements `cdpr_rt.core.cycle.Watch`.

    A task of `clock` polls and writes. `stop_reason` checks the age of the last good poll itself,
    so that a task that waits for an answer trips as well. While nobody waits by the clock nor runs
    cycles there are no polls: then the device's own watchdog opens the contactor and applies the
    brakes. A trip stays, also in the file `latch`, until
    `acknowledge`. The contactor closes only by `energise`. Leaving the block applies the brakes and
    opens the contactor.
    """

    def __init__(self, profile: SafetyIoProfile, clock: Clock, latch: Path | None = None) -> None:
        self.profile = profile
        self.clock = clock
        self._link = IoLink(profile, clock)
        self.name = self._link.name
        self._latch_file = latch
        self._rules = Rules(profile)
        self._contactor = profile.contactor.output.coil
        self._brakes = {a.axis: a.brake for a in profile.axes if a.brake is not None}
        safe = [self._contactor, *(brake.output.coil for brake in self._brakes.values())]
        self._outputs = dict.fromkeys(safe, False)
        self._written: dict[int, bool] = {}
        self._lights: dict[int, bool] = {}
        self._armed = self._trip_saved = False
        self._alarm = self._stop = self._error = ""
        self._stop_at_s = 0.0
        self._timeout_s = profile.trip_timeout_s
        self._last_poll_s = self._last_check_s = 0.0
        self._extended_poll_s = self._extended_at_s = 0.0
        self._state: IoState | None = None
        self._task: Task[None] | None = None

    # -- what the loop asks every cycle

    def alarm(self) -> str:
        """Return why the torque must go at once, or an empty text."""
        return self._alarm

    def stop_reason(self) -> str:
        """Return why the motion must be braked to its end, or an empty text."""
        now = self.clock.now_s
        last_poll_s, timeout = self._last_poll_s, self._timeout_s
        if now - last_poll_s > timeout and self._armed and not self._stop:
            # cycles that begin after a pause without polls are no silence yet: the time-out is
            # extended once for each good poll
            if now - self._last_check_s > timeout and last_poll_s != self._extended_poll_s:
                self._extended_poll_s, self._extended_at_s = last_poll_s, now
            elif last_poll_s != self._extended_poll_s or now - self._extended_at_s > timeout:
                self._trip(stop=self._silence_reason())
        self._last_check_s = now
        return self._stop

    # -- interface

    @property
    def state(self) -> IoState:
        """State at the last good poll, which is that of `IoState.at_s`."""
        assert self._state is not None  # `open` has polled
        return self._state

    def open(self) -> Self:
        """Connect, set all outputs safe, and begin to poll.

        Raises ModbusError, and SafetyIoError for an I/O whose outputs somebody else has set.
        """
        try:
            self._refuse_in_use(self._link.state())
            self._link.set_watchdog()
            self._poll()
        except BaseException:
            self._link.close()
            raise
        self._task = self.clock.start(self._run)
        return self

    def energise(self) -> None:
        """Close the contactor and watch from now on; raises SafetyIoError where that is refused."""
        tripped = self._tripped or self._saved_trip()
        if tripped:
            raise SafetyIoError(f"{tripped}; see to it, then acknowledge it: cdpr io ack")
        self._refuse(self._obstacle(self._next()))
        self._rules.restart(self.clock.now_s)
        self._armed = self._outputs[self._contactor] = True
        self._await(lambda state: state.contactor_closed, self.profile.contactor.timeout_s)

    def release_brakes(self, *axes: str) -> None:
        """Have brakes released (all, where none is named), as `brakes_released` confirms.

        Raises SafetyIoError for an axis without brake.
        """
        self._set_brakes(axes, True)

    def apply_brakes(self, *axes: str) -> None:
        """Have brakes applied (all, where none is named)."""
        self._set_brakes(axes, False)

    def brakes_released(self) -> bool:
        """Return whether every brake's feedback says released."""
        return all(self.state.brakes_released.values())

    def await_brakes(self, released: bool, *axes: str) -> None:
        """Wait until the feedback of brakes says `released` (or not); raises SafetyIoError."""
        names = axes or tuple(self._brakes)
        longest = max((self._brake(name).timeout_s for name in names), default=0.0)
        self._await(lambda s: all(s.brakes_released[n] == released for n in names), longest)

    def de_energise(self) -> str:
        """Apply the brakes, open the contactor; return which did not follow, else an empty text."""
        self._armed = False
        if self._task is not None and self._task.done:  # an interrupt may have ended it
            self._task = self.clock.start(self._run)
        self.apply_brakes()
        unconfirmed = self._problem(lambda: self.await_brakes(False))
        self._outputs[self._contactor] = False
        timeout_s = self.profile.contactor.timeout_s
        opened = self._problem(lambda: self._await(lambda s: not s.contactor_closed, timeout_s))
        return "; ".join(dict.fromkeys(text for text in (unconfirmed, opened) if text))

    def acknowledge(self) -> None:
        """Forget a trip whose cause is gone; raises SafetyIoError while it is not."""
        self._refuse(self._obstacle(self._next(), limits=False))
        self._alarm = self._stop = ""
        self._trip_saved = False
        self._written.clear()
        self._rules.restart(self.clock.now_s)
        if self._latch_file is not None:
            remove_state(self._latch_file)

    def close(self) -> str:
        """Apply the brakes, open the contactor and disconnect; return which did not follow."""
        if self._task is None:
            return ""
        unconfirmed = self.de_energise()
        self.clock.cancel(self._task)
        self._task = None
        self._save_trip()
        with contextlib.suppress(ModbusError):
            for colour, output in self.profile.lights.items():
                if colour in _STATE_COLOURS:  # red stays on until the trip is acknowledged
                    on = colour == "red" and bool(self._tripped)
                    self._link.write(output.coil, on != output.inverted)
        self._link.close()
        return unconfirmed

    def __enter__(self) -> Self:
        return self.open()

    def __exit__(self, _kind: object, error: BaseException | None, _trace: object) -> None:
        unconfirmed = self.close()
        if unconfirmed and error is None:
            raise SafetyIoError(unconfirmed)
        if unconfirmed and error is not None:
            error.add_note(unconfirmed)

    # -- the polling task

    def _run(self) -> None:
        clock = self.clock
        due_s = clock.now_s
        while True:
            due_s = max(due_s + self.profile.poll_period_s, clock.now_s)
            clock.wait(None, due_s)
            try:
                self._poll()
            except ModbusError as error:
                self._error = str(error)
            except Exception as error:
                # a task that ended could switch nothing off any more; this counts as silence
                self._error = f"{type(error).__name__}: {error}"
            self._save_trip()

    def _poll(self) -> None:
        """Write changed outputs, read all points, check the rules; raises ModbusError."""
        began = self.clock.now_s
        self._link.feed_watchdog()
        outputs = self._write()
        inputs, coils = self._link.read()
        state = interpret(self.profile, inputs, coils, began)
        self._state, self._last_poll_s, self._error = state, began, ""
        overwritten = {coil: coils[coil] for coil, on in outputs.items() if coils[coil] != on}
        alarm = self._rules.alarm(state, inputs, outputs, overwritten)
        armed = self._armed
        if armed and alarm:
            self._trip(alarm=f"{self.name}: {alarm}")
        elif armed and state.limits:
            self._trip(stop=f"{self.name}: {state.limits[0]}")
        if self._alarm or (self._stop and began - self._stop_at_s > _STOP_GRACE_S):
            self._switch_off()
        self._light(state)

    def _write(self) -> dict[int, bool]:
        outputs = dict(self._outputs)
        for coil, on in (outputs | self._lights).items():
            if self._written.get(coil) != on:
                self._link.write(coil, on)
                self._written[coil] = on
        return outputs

    def _switch_off(self) -> None:
        """Apply all brakes and open the contactor, without waiting for the next poll."""
        self._outputs = dict.fromkeys(self._outputs, False)
        self._write()

    def _light(self, state: IoState) -> None:
        """Show red: tripped or stopped; yellow: power is on; green: ready; with the next poll."""
        red = bool(self._tripped or not state.chain_ok)
        yellow = state.contactor_closed
        shown = {"red": red, "yellow": yellow, "green": not red and not yellow}
        for colour, output in self.profile.lights.items():
            if colour in shown:
                self._lights[output.coil] = shown[colour] != output.inverted

    # -- trips

    @property
    def _tripped(self) -> str:
        return self._alarm or self._stop

    def _trip(self, alarm: str = "", stop: str = "") -> None:
        self._alarm = self._alarm or alarm
        if stop and not self._stop:
            self._stop, self._stop_at_s = stop, self.clock.now_s

    def _save_trip(self) -> None:
        """Save a new trip for later commands; never in the control cycle, as disks block."""
        reason, latch = self._tripped, self._latch_file
        if not reason or self._trip_saved or latch is None:
            return
        self._trip_saved = True
        date = datetime.now(UTC).isoformat(timespec="seconds")
        try:
            self.clock.run_blocking(partial(write_state, latch, {"reason": reason, "date": date}))
        except StateFileError as error:
            self._alarm = f"{reason} ({error})"

    def _saved_trip(self) -> str:
        """Return the trip that an earlier command has left, or an empty text."""
        if self._latch_file is None:
            return ""
        try:
            held = read_state(self._latch_file)
        except StateFileError as error:
            return str(error)
        return "" if held is None else f"tripped on {held.get('date')}: {held.get('reason')}"

    def _silence_reason(self) -> str:
        age = self.clock.now_s - self._last_poll_s
        return (
            f"{self.name}: no good poll for {age:.2f} s, {self._timeout_s:g} s allowed "
            f"({self._error or 'no answer has come'})"
        )

    def _obstacle(self, state: IoState, limits: bool = True) -> str:
        """Return what forbids to energise, or an empty text."""
        if not state.chain_ok:
            return (
                f"the emergency-stop chain is open (input {self.profile.chain.input}): release "
                "the buttons and reset the chain"
            )
        if state.contactor_closed and not self._outputs[self._contactor]:
            feedback = self.profile.contactor.feedback.input
            return (
                f"the contactor is closed (input {feedback}) though output {self._contactor} is 0; "
                "is it welded?"
            )
        for axis, brake in self._brakes.items():
            if state.brakes_released[axis] and not self._outputs[brake.output.coil]:
                return (
                    f"the brake of {axis} is released (input {brake.feedback.input}) though "
                    f"output {brake.output.coil} is 0; is it stuck?"
                )
        return state.limits[0] if limits and state.limits else ""

    # -- waiting

    def _refuse_in_use(self, state: IoState) -> None:
        if state.contactor_asked or any(state.brakes_asked.values()):
            raise SafetyIoError(
                f"{self.name}: its outputs for contactor or brakes are on already: another command "
                "uses it, or has died (the device's own watchdog switches them off then; "
                "otherwise: cdpr io off)"
            )

    def _refuse(self, obstacle: str) -> None:
        if obstacle:
            raise SafetyIoError(f"{self.name}: {obstacle}")

    def _set_brakes(self, axes: tuple[str, ...], released: bool) -> None:
        coils = [self._brake(axis).output.coil for axis in axes or self._brakes]
        if released and self._tripped:
            raise SafetyIoError(self._tripped)
        for coil in coils:
            self._outputs[coil] = released

    def _brake(self, axis: str) -> Brake:
        brake = self._brakes.get(axis)
        if brake is None:
            known = ", ".join(repr(name) for name in self._brakes) or "none"
            raise SafetyIoError(f"{self.name}: {axis!r} has no brake there; with one: {known}")
        return brake

    def _next(self) -> IoState:
        """Return the state at a poll begun from now on; raises SafetyIoError without one."""
        return self._await(lambda _: True, 0.0)

    def _await(self, done: Callable[[IoState], bool], timeout_s: float) -> IoState:
        """Wait until `done` holds at a poll begun from now on; raises SafetyIoError."""
        clock, asked_s = self.clock, self.clock.now_s

        def settled() -> bool:
            return (self._armed and bool(self._tripped)) or (
                self.state.at_s > asked_s and done(self.state)
            )

        # the rules know better what is wrong, a poll after the same time
        followed = clock.wait(settled, asked_s + timeout_s + self._timeout_s)
        state = self.state
        if self._armed and self._tripped:
            raise SafetyIoError(self._tripped)
        if followed:
            return state
        if clock.now_s - state.at_s > self._timeout_s:
            raise SafetyIoError(self._silence_reason())
        raise SafetyIoError(f"{self.name}: {self._obstacle(state) or 'does not follow'}")

    @staticmethod
    def _problem(wait: Callable[[], object]) -> str:
        try:
            wait()
        except SafetyIoError as error:
            return str(error)
        return ""
