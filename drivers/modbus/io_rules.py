"""State of a safety I/O from one poll, and the rules that turn it into alarms."""

from __future__ import annotations

from dataclasses import dataclass

from cdpr_profiles.devices.safety_io import (
    Brake,
    Contactor,
    DigitalInput,
    DigitalOutput,
    SafetyIoProfile,
)

_OVERWRITTEN_POLLS = 2
"""Polls in a row in which an output is not what was written before it is an alarm."""


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
    """By axis, as the feedback contacts say."""
    limits: tuple[str, ...]
    """Limit switches that are reached, in words."""
    lights: dict[str, bool]


def reads(point: DigitalInput, image: dict[int, bool]) -> bool:
    """Return whether the input is active, inversion taken into account."""
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
            f"{axis.axis} stands on its {name} limit switch ({described(point, inputs)})"
            for axis in profile.axes
            for name, point in axis.limits()
            if reads(point, inputs)
        ),
        lights={colour: _on(output, coils) for colour, output in profile.lights.items()},
    )


def _on(output: DigitalOutput, coils: dict[int, bool]) -> bool:
    return coils[output.coil] != output.inverted


class FeedbackMonitor:
    """Monitors that a feedback contact follows its output in time, and stays."""

    def __init__(self, what: str, device: Contactor | Brake, on: str, off: str) -> None:
        self._name, self._device = what, device
        self._names = {True: on, False: off}
        self._commanded = False
        self._since_s = 0.0
        self.confirmed = False
        """Whether the feedback has followed the output's last change."""

    def check(self, commanded: bool, inputs: dict[int, bool], now_s: float) -> str:
        """Return what is wrong with the device, or an empty text."""
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
        """Restart the feedback's time-out, after the fault was acknowledged."""
        self._since_s, self.confirmed = now_s, False

    def _stuck(self) -> str:
        return "; is it welded?" if isinstance(self._device, Contactor) else "; is it stuck?"


class Rules:
    """Checks each poll against the outputs that were commanded."""

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
    ) -> str:
        """Return why the torque must go at once; the likeliest cause first.

        `outputs` are the coils as written, `overwritten` those that read back another value.
        """
        profile, now = self._profile, state.at_s
        closed = outputs[profile.contactor.output.coil]
        texts = [self._chain(state, inputs)]
        texts.append(self.contactor.check(closed, inputs, now))
        for axis in profile.axes:
            if axis.brake is not None:
                commanded = outputs[axis.brake.output.coil]
                texts.append(self.brakes[axis.axis].check(commanded, inputs, now))
        texts.append(self._overwritten(outputs, overwritten))
        return next((text for text in texts if text), "")

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
        """Begin anew after an acknowledgement."""
        self._overwritten_polls.clear()
        for monitor in (self.contactor, *self.brakes.values()):
            monitor.restart(now_s)
