"""What one poll of a safety I/O says, and what of it must not be."""

from __future__ import annotations

from dataclasses import dataclass

from profiles.safety_io import Brake, Contactor, Input, Output, SafetyIoProfile

_STRAY_POLLS = 2
"""Polls in a row in which an output is not what was written, before it counts."""


@dataclass(frozen=True)
class IoState:
    """What one good poll saw; made once, never changed."""

    at_s: float
    """Time of the robot's clock at which the poll was begun: nothing in it is older."""
    chain_ok: bool
    contactor_asked: bool
    contactor_closed: bool
    brakes_asked: dict[str, bool]
    brakes_released: dict[str, bool]
    """By axis, as the feedback contacts say."""
    limits: tuple[str, ...]
    """Limit switches that are reached, in words."""
    lights: dict[str, bool]


def reads(point: Input, image: dict[int, bool]) -> bool:
    """Return whether what the input stands for is so."""
    return image[point.input] != point.inverted


def described(point: Input, image: dict[int, bool]) -> str:
    """Return the input with the value on the wire, for messages."""
    return f"input {point.input} reads {int(image[point.input])}"


def interpret(
    profile: SafetyIoProfile, inputs: dict[int, bool], coils: dict[int, bool], at_s: float
) -> IoState:
    """Return the state that the images of inputs and coils stand for."""
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


def _on(output: Output, coils: dict[int, bool]) -> bool:
    return coils[output.coil] != output.inverted


class Follower:
    """Watches that a feedback contact follows its output in time, and keeps to it."""

    def __init__(self, what: str, device: Contactor | Brake, on: str, off: str) -> None:
        self._what, self._device = what, device
        self._names = {True: on, False: off}
        self._asked = False
        self._since_s = 0.0
        self.confirmed = False
        """Whether the feedback has followed the output's last change."""

    def check(self, asked: bool, inputs: dict[int, bool], now_s: float) -> str:
        """Return what is wrong with the device, or an empty text."""
        if asked != self._asked:
            self._asked, self._since_s, self.confirmed = asked, now_s, False
        feedback = self._device.feedback
        wanted, output = self._names[asked], self._device.output.coil
        if reads(feedback, inputs) == asked:
            self.confirmed = True
            return ""
        if self.confirmed:
            return (
                f"{self._what} did not stay {wanted}: output {output} is {int(asked)}, but "
                f"{described(feedback, inputs)}"
            )
        waited = now_s - self._since_s
        if waited <= self._device.timeout_s:
            return ""
        return (
            f"{self._what} is not {wanted} {waited:.2f} s after output {output} was set to "
            f"{int(asked)} ({self._device.timeout_s:g} s allowed): {described(feedback, inputs)}"
            f"{'' if asked else self._stuck()}"
        )

    def restart(self, now_s: float) -> None:
        """Give the feedback its time once more, after the fault was acknowledged."""
        self._since_s, self.confirmed = now_s, False

    def _stuck(self) -> str:
        return "; is it welded?" if isinstance(self._device, Contactor) else "; is it stuck?"


class Rules:
    """Holds poll after poll against what was asked for."""

    def __init__(self, profile: SafetyIoProfile) -> None:
        self._profile = profile
        self._strays: dict[int, int] = {}
        self.contactor = Follower("the contactor", profile.contactor, "closed", "open")
        self.brakes = {
            axis.axis: Follower(f"the brake of {axis.axis}", axis.brake, "released", "applied")
            for axis in profile.axes
            if axis.brake is not None
        }

    def alarm(
        self,
        state: IoState,
        inputs: dict[int, bool],
        wanted: dict[int, bool],
        stray: dict[int, bool],
    ) -> str:
        """Return why the torque must go at once; the likeliest cause first.

        `wanted` are the coils as written, `stray` those that hold something else.
        """
        profile, now = self._profile, state.at_s
        closed = wanted[profile.contactor.output.coil]
        texts = [self._chain(state, inputs)]
        texts.append(self.contactor.check(closed, inputs, now))
        for axis in profile.axes:
            if axis.brake is not None:
                asked = wanted[axis.brake.output.coil]
                texts.append(self.brakes[axis.axis].check(asked, inputs, now))
        texts.append(self._stray(wanted, stray))
        return next((text for text in texts if text), "")

    def _chain(self, state: IoState, inputs: dict[int, bool]) -> str:
        if state.chain_ok:
            return ""
        return f"the emergency-stop chain is open ({described(self._profile.chain, inputs)})"

    def _stray(self, wanted: dict[int, bool], stray: dict[int, bool]) -> str:
        self._strays = {coil: self._strays.get(coil, 0) + 1 for coil in stray}
        for coil, polls in self._strays.items():
            if polls >= _STRAY_POLLS:
                return (
                    f"output {coil} was set to {int(wanted[coil])} and reads {int(stray[coil])}: "
                    "the device's own watchdog or another master has changed it"
                )
        return ""

    def restart(self, now_s: float) -> None:
        """Begin anew after an acknowledgement."""
        self._strays.clear()
        for follower in (self.contactor, *self.brakes.values()):
            follower.restart(now_s)
