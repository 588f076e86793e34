"""A safety I/O that is polled in parallel to the cycle; it trips on inputs and on missing polls."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Final, Self

from cdpr_drivers.errors import DriverError
from cdpr_drivers.modbus.channel import ModbusError, ModbusTcp
from cdpr_profiles.safety_io import (
    Brake,
    Contactor,
    DigitalInput,
    DigitalOutput,
    SafetyIoProfile,
)
from cdpr_rt.core.clock import Clock, Task
from cdpr_rt.state_file import StateFileError, read_state, remove_state, write_state

# State of a safety I/O from one poll, and the rules that derive alarms from it.

_OVERWRITTEN_POLLS = 2
"""Polls in a row in which an output differs from the written value before the alarm."""


class Trip(str):
    """Why a motion must end, as text, with the kind of trip and the axis from the profile."""

    code: str
    axis: str

    def __new__(cls, text: str = "", code: str = "", axis: str = "") -> Self:
        """Return the text with its kind and its axis; "" if unset."""
        trip = super().__new__(cls, text)
        trip.code, trip.axis = code, axis
        return trip


NO_TRIP: Final = Trip()


@dataclass(frozen=True)
class IoState:
    """State of the I/O at one good poll."""

    at_s: float
    """Time of the robot's clock at which the poll began."""
    chain_ok: bool
    contactor_asked: bool
    contactor_closed: bool
    brakes_asked: dict[str, bool]
    brakes_released: dict[str, bool]
    """Whether each axis' brake is released, from the feedback contacts."""
    limits: tuple[Trip, ...]
    """Limit switches that are active."""
    lights: dict[str, bool]


def reads(point: DigitalInput, image: dict[int, bool]) -> bool:
    """Return whether the input is active; accounts for inversion."""
    return image[point.input] != point.inverted


def described(point: DigitalInput, image: dict[int, bool]) -> str:
    """Return the input with its raw value, for messages."""
    return f"input {point.input} reads {int(image[point.input])}"


def interpret(
    profile: SafetyIoProfile, inputs: dict[int, bool], coils: dict[int, bool], at_s: float
) -> IoState:
    """Return the state given by the images of inputs and coils."""
    braked = [(axis.axis, axis.brake) for axis in profile.axes if axis.brake is not None]
    return IoState(
        at_s=at_s,
        chain_ok=reads(profile.chain, inputs),
        contactor_asked=_on(profile.contactor.output, coils),
        contactor_closed=reads(profile.contactor.feedback, inputs),
        brakes_asked={axis: _on(brake.output, coils) for axis, brake in braked},
        brakes_released={axis: reads(brake.feedback, inputs) for axis, brake in braked},
        limits=tuple(
            Trip(
                f"{axis.axis} stands on its {name} limit switch ({described(point, inputs)})",
                "limit_switch",
                axis.axis,
            )
            for axis in profile.axes
            for name, point in axis.limits()
            if reads(point, inputs)
        ),
        lights={colour: _on(output, coils) for colour, output in profile.lights.items()},
    )


def _on(output: DigitalOutput, coils: dict[int, bool]) -> bool:
    return coils[output.coil] != output.inverted


class FeedbackMonitor:
    """Checks that a feedback contact follows its output in time and then stays there."""

    def __init__(self, what: str, device: Contactor | Brake, on: str, off: str) -> None:
        self._name, self._device = what, device
        self._names = {True: on, False: off}
        self._commanded = False
        self._since_s = 0.0
        self.confirmed = False
        """Whether the feedback has followed the output's last change."""

    def check(self, commanded: bool, inputs: dict[int, bool], now_s: float) -> str:
        """Return the device's fault, or an empty text."""
        if commanded != self._commanded:
            self._commanded, self._since_s, self.confirmed = commanded, now_s, False
        feedback = self._device.feedback
        expected, output = self._names[commanded], self._device.output.coil
        if reads(feedback, inputs) == commanded:
            self.confirmed = True
            return ""
        if self.confirmed:
            return (
                f"{self._name} did not stay {expected}: output {output} is {int(commanded)}, but "
                f"{described(feedback, inputs)}"
            )
        waited = now_s - self._since_s
        if waited <= self._device.timeout_s:
            return ""
        return (
            f"{self._name} is not {expected} {waited:.2f} s after output {output} was set "
            f"to {int(commanded)} ({self._device.timeout_s:g} s allowed): "
            f"{described(feedback, inputs)}"
            f"{'' if commanded else self._stuck()}"
        )

    def restart(self, now_s: float) -> None:
        """Restart the feedback's timeout, after the fault was acknowledged."""
        self._since_s, self.confirmed = now_s, False

    def _stuck(self) -> str:
        return "; is it welded?" if isinstance(self._device, Contactor) else "; is it stuck?"


class Rules:
    """Checks each poll against the commanded outputs."""

    def __init__(self, profile: SafetyIoProfile) -> None:
        self._profile = profile
        self._overwritten_polls: dict[int, int] = {}
        self.contactor = FeedbackMonitor("the contactor", profile.contactor, "closed", "open")
        self.brakes = {
            axis.axis: FeedbackMonitor(
                f"the brake of {axis.axis}", axis.brake, "released", "applied"
            )
            for axis in profile.axes
            if axis.brake is not None
        }

    def alarm(
        self,
        state: IoState,
        inputs: dict[int, bool],
        outputs: dict[int, bool],
        overwritten: dict[int, bool],
    ) -> Trip:
        """Return why the torque must be removed immediately: the most likely cause, or "".

        `outputs` are the coils as written, `overwritten` those that read back a different value.
        """
        profile, now = self._profile, state.at_s
        closed = outputs[profile.contactor.output.coil]
        trips = [Trip(self._chain(state, inputs), "chain_open")]
        trips.append(Trip(self.contactor.check(closed, inputs, now), "contactor"))
        for axis in profile.axes:
            if axis.brake is not None:
                commanded = outputs[axis.brake.output.coil]
                text = self.brakes[axis.axis].check(commanded, inputs, now)
                trips.append(Trip(text, "brake", axis.axis))
        trips.append(Trip(self._overwritten(outputs, overwritten), "output"))
        return next((trip for trip in trips if trip), NO_TRIP)

    def _chain(self, state: IoState, inputs: dict[int, bool]) -> str:
        if state.chain_ok:
            return ""
        return f"the emergency-stop chain is open ({described(self._profile.chain, inputs)})"

    def _overwritten(self, outputs: dict[int, bool], overwritten: dict[int, bool]) -> str:
        self._overwritten_polls = {
            coil: self._overwritten_polls.get(coil, 0) + 1 for coil in overwritten
        }
        for coil, polls in self._overwritten_polls.items():
            if polls >= _OVERWRITTEN_POLLS:
                return (
                    f"output {coil} was set to {int(outputs[coil])} and reads "
                    f"{int(overwritten[coil])}: the device's own watchdog or another "
                    "master has changed it"
                )
        return ""

    def restart(self, now_s: float) -> None:
        """Start again after an acknowledgement."""
        self._overwritten_polls.clear()
        for monitor in (self.contactor, *self.brakes.values()):
            monitor.restart(now_s)


# Reads and writes of a safety I/O in the layout of its profile, one request for each image.


class IoLink:
    """A connection to one safety I/O; every method raises ModbusError."""

    def __init__(self, profile: SafetyIoProfile, clock: Clock) -> None:
        self.profile = profile
        self.clock = clock
        place = (profile.host, profile.port, profile.unit)
        self._client = ModbusTcp(*place, profile.answer_timeout_s, clock)
        self.name = f"safety I/O {self._client.name}"
        self._inputs = _span(point.input for _, point in profile.inputs())
        self._coils = _span(point.coil for _, point in profile.outputs())
        self._count = 0

    def read(self) -> tuple[dict[int, bool], dict[int, bool]]:
        """Return the discrete inputs and the coils by address."""
        start, count = self._inputs
        inputs = dict(enumerate(self._client.inputs(start, count), start))
        start, count = self._coils
        return inputs, dict(enumerate(self._client.coils(start, count), start))

    def state(self) -> IoState:
        """Return the state that the I/O reports now."""
        began_s = self.clock.now_s
        return interpret(self.profile, *self.read(), began_s)

    def write(self, coil: int, on: bool) -> None:
        """Set one coil."""
        self._client.write_coil(coil, on)

    def set_watchdog(self) -> None:
        """Set the time without requests after which the device must drop its outputs."""
        watchdog = self.profile.watchdog
        if watchdog is not None and watchdog.timeout_register is not None:
            time_units = round(watchdog.timeout_s / watchdog.timeout_unit_s)
            self._client.write_registers(watchdog.timeout_register, [time_units])

    def feed_watchdog(self) -> None:
        """Reset the device's watchdog."""
        watchdog = self.profile.watchdog
        if watchdog is not None and watchdog.trigger_register is not None:
            self._count = (self._count + 1) & 0xFFFF
            self._client.write_registers(watchdog.trigger_register, [self._count])

    def close(self) -> None:
        """Disconnect from the device."""
        self._client.close()


def _span(addresses: Iterable[int]) -> tuple[int, int]:
    """Return first address and count of the shortest span that holds all addresses."""
    known = sorted(addresses)
    return known[0], known[-1] - known[0] + 1


_STOP_GRACE_S: Final = 2.0
"""Longest time of a controlled stop; after it, the power is cut even during motion."""
_STATE_COLOURS: Final = ("red", "yellow", "green")


class SafetyIoError(DriverError):
    """The safety I/O forbids a request or did not execute it; names the point and its value."""


class SafetyIo:
    """One safety I/O.

    A task of `clock` polls and writes. `stop_reason` checks the age of the last good poll, so that
    it also trips while the task waits for an answer. If no task waits by the clock and no cycles
    run, nothing polls: then the device's own watchdog opens the contactor and applies the
    brakes. A trip stays until `acknowledge`; the file `latch` also stores it.
    Only `energise` closes the contactor. The end of the block applies the brakes and opens the
    contactor.
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
        self._alarm = self._stop = NO_TRIP
        self._error = ""
        self._stop_at_s = 0.0
        self._timeout_s = profile.trip_timeout_s
        self._last_poll_s = self._last_check_s = 0.0
        self._extended_poll_s = self._extended_at_s = 0.0
        self._state: IoState | None = None
        self._task: Task[None] | None = None

    # -- queried by the loop every cycle

    def alarm(self) -> Trip:
        """Return why the torque must be removed immediately, or an empty text."""
        return self._alarm

    def stop_reason(self) -> Trip:
        """Return why the motion must be braked to a standstill, or an empty text."""
        now = self.clock.now_s
        last_poll_s, timeout = self._last_poll_s, self._timeout_s
        if now - last_poll_s > timeout and self._armed and not self._stop:
            # if cycles start after a pause without polls, that pause is not a silence of the
            # device: the timeout is extended once for each good poll
            if now - self._last_check_s > timeout and last_poll_s != self._extended_poll_s:
                self._extended_poll_s, self._extended_at_s = last_poll_s, now
            elif last_poll_s != self._extended_poll_s or now - self._extended_at_s > timeout:
                self._trip(stop=Trip(self._silence_reason(), "no_poll"))
        self._last_check_s = now
        return self._stop

    # -- interface

    @property
    def state(self) -> IoState:
        """State at the last good poll, taken at `IoState.at_s`."""
        assert self._state is not None  # `open` has polled
        return self._state

    def open(self) -> Self:
        """Connect, set all outputs to safe, and start to poll.

        Raises ModbusError, and SafetyIoError if another client has set the I/O's outputs.
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
        """Close the contactor and monitor from now on; raises SafetyIoError if not allowed."""
        tripped = self._tripped or self._saved_trip()
        if tripped:
            raise SafetyIoError(f"{tripped}; remove the cause, then acknowledge it: cdpr io ack")
        self._refuse(self._obstacle(self._next()))
        self._rules.restart(self.clock.now_s)
        self._armed = self._outputs[self._contactor] = True
        self._await(lambda state: state.contactor_closed, self.profile.contactor.timeout_s)

    def release_brakes(self, *axes: str) -> None:
        """Release brakes (default: all); `brakes_released` confirms it.

        Raises SafetyIoError for an axis without a brake.
        """
        self._set_brakes(axes, True)

    def apply_brakes(self, *axes: str) -> None:
        """Apply brakes (default: all)."""
        self._set_brakes(axes, False)

    def brakes_released(self) -> bool:
        """Return whether every brake's feedback reports released."""
        return all(self.state.brakes_released.values())

    def await_brakes(self, released: bool, *axes: str) -> None:
        """Wait until the brakes' feedback equals `released`; raises SafetyIoError."""
        names = axes or tuple(self._brakes)
        longest = max((self._brake(name).timeout_s for name in names), default=0.0)
        self._await(lambda s: all(s.brakes_released[n] == released for n in names), longest)

    def de_energise(self) -> str:
        """Apply the brakes, open the contactor; return which of them did not follow, or ""."""
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
        """Clear a trip whose cause is gone; raises SafetyIoError while the cause remains."""
        self._refuse(self._obstacle(self._next(), limits=False))
        self._alarm = self._stop = NO_TRIP
        self._trip_saved = False
        self._written.clear()
        self._rules.restart(self.clock.now_s)
        if self._latch_file is not None:
            remove_state(self._latch_file)

    def close(self) -> str:
        """Apply the brakes, open the contactor, disconnect; return which did not follow, or ""."""
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
                # a task that has ended cannot switch anything off, so its end counts as silence
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
            self._trip(alarm=self._named(alarm))
        elif armed and state.limits:
            self._trip(stop=self._named(state.limits[0]))
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
        """Apply all brakes and open the contactor now, without waiting for the next poll."""
        self._outputs = dict.fromkeys(self._outputs, False)
        self._write()

    def _light(self, state: IoState) -> None:
        """Set the light for the next poll: red if tripped or stopped, else yellow or green."""
        red = bool(self._tripped or not state.chain_ok)
        yellow = state.contactor_closed
        shown = {"red": red, "yellow": yellow, "green": not red and not yellow}
        for colour, output in self.profile.lights.items():
            if colour in shown:
                self._lights[output.coil] = shown[colour] != output.inverted

    # -- trips

    @property
    def _tripped(self) -> Trip:
        return self._alarm or self._stop

    def _named(self, trip: Trip) -> Trip:
        return Trip(f"{self.name}: {trip}", trip.code, trip.axis)

    def _trip(self, alarm: Trip = NO_TRIP, stop: Trip = NO_TRIP) -> None:
        self._alarm = self._alarm or alarm
        if stop and not self._stop:
            self._stop, self._stop_at_s = stop, self.clock.now_s

    def _save_trip(self) -> None:
        """Save a new trip for later commands; not in the control cycle, because disks block."""
        reason, latch = self._tripped, self._latch_file
        if not reason or self._trip_saved or latch is None:
            return
        self._trip_saved = True
        date = datetime.now(UTC).isoformat(timespec="seconds")
        try:
            self.clock.run_blocking(
                partial(write_state, latch, {"reason": str(reason), "date": date})
            )
        except StateFileError as error:
            self._alarm = Trip(f"{reason} ({error})", reason.code, reason.axis)

    def _saved_trip(self) -> str:
        """Return the trip stored by an earlier command, or an empty text."""
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
            f"({self._error or 'no answer has arrived'})"
        )

    def _obstacle(self, state: IoState, limits: bool = True) -> str:
        """Return the reason not to energise, or an empty text."""
        if not state.chain_ok:
            return (
                f"the emergency-stop chain is open (input {self.profile.chain.input}): release "
                "the buttons and reset the chain"
            )
        if state.contactor_closed and not self._outputs[self._contactor]:
            feedback = self.profile.contactor.feedback.input
            return (
                f"the contactor is closed (input {feedback}) although output {self._contactor} "
                "is 0; is it welded?"
            )
        for axis, brake in self._brakes.items():
            if state.brakes_released[axis] and not self._outputs[brake.output.coil]:
                return (
                    f"the brake of {axis} is released (input {brake.feedback.input}) although "
                    f"output {brake.output.coil} is 0; is it stuck?"
                )
        return state.limits[0] if limits and state.limits else ""

    # -- waiting

    def _refuse_in_use(self, state: IoState) -> None:
        if state.contactor_asked or any(state.brakes_asked.values()):
            raise SafetyIoError(
                f"{self.name}: its outputs for contactor or brakes are already on: wait "
                "until the command that uses it ends; if that command has died, wait for the "
                "device's watchdog, or use cdpr io off"
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
            raise SafetyIoError(f"{self.name}: {axis!r} has no brake; axes with one: {known}")
        return brake

    def _next(self) -> IoState:
        """Return the state at a poll that begins after this call; raises SafetyIoError if none."""
        return self._await(lambda _: True, 0.0)

    def _await(self, done: Callable[[IoState], bool], timeout_s: float) -> IoState:
        """Wait until `done` holds at a poll that begins after this call; raises SafetyIoError."""
        clock, asked_s = self.clock, self.clock.now_s

        def settled() -> bool:
            return (self._armed and bool(self._tripped)) or (
                self.state.at_s > asked_s and done(self.state)
            )

        # the rules detect the same timeout in a poll, and give a more precise cause
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
