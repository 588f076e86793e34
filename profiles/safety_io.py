"""Safety I/O: the assignment of the inputs and outputs of a remote I/O on Modbus TCP."""

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from cdpr_profiles.bounded_input import read_toml
from cdpr_profiles.errors import ProfileError
from cdpr_profiles.places import require
from cdpr_profiles.reader import Profile, read_toml_model, require_unique, validated

Address = Annotated[int, Field(ge=0, le=0xFFFF)]
# limit of one Modbus request: all inputs, or all outputs, must fit into one
MOST_POINTS = 1968

LightColour = Literal["red", "yellow", "green", "blue", "white"]


class DigitalInput(Profile):
    """A discrete input; `inverted` if 0 stands for the state that the key names."""

    input: Address
    inverted: bool = False


class DigitalOutput(Profile):
    """A coil; `inverted` if writing 0 has the effect that the key names."""

    coil: Address
    inverted: bool = False


class Contactor(Profile):
    """The enable contactor, which `output` closes; `feedback` is true while it is closed."""

    output: DigitalOutput
    feedback: DigitalInput
    timeout_s: float = Field(default=0.3, gt=0, le=10)
    """Longest time from the output to the feedback."""


class Brake(Profile):
    """A brake that `output` releases; without output or supply it is applied."""

    output: DigitalOutput
    feedback: DigitalInput
    """True while the brake is released."""
    timeout_s: float = Field(default=0.3, gt=0, le=10)


class AxisPoints(Profile):
    """Points of one axis; `axis` is its name in messages, such as "winch 1"."""

    axis: str = Field(min_length=1)
    node_id: int | None = Field(default=None, ge=1, le=127)
    """Node id of the axis' drive, by which a session finds its brake."""
    brake: Brake | None = None
    limit_negative: DigitalInput | None = None
    """True while the axis is on the switch."""
    limit_positive: DigitalInput | None = None

    def limits(self) -> Iterator[tuple[str, DigitalInput]]:
        """Yield the limit switches of the axis, each with its name."""
        for name, point in (("negative", self.limit_negative), ("positive", self.limit_positive)):
            if point is not None:
                yield name, point


class Lights(Profile):
    """The stack light's colours."""

    red: DigitalOutput | None = None
    yellow: DigitalOutput | None = None
    green: DigitalOutput | None = None
    blue: DigitalOutput | None = None
    white: DigitalOutput | None = None

    def items(self) -> Iterator[tuple[LightColour, DigitalOutput]]:
        """Yield the colours that exist."""
        colours: tuple[LightColour, ...] = ("red", "yellow", "green", "blue", "white")
        for colour in colours:
            output = getattr(self, colour)
            if output is not None:
                yield colour, output


class DeviceWatchdog(Profile):
    """The device's watchdog: after `timeout_s` without requests, its outputs drop."""

    timeout_s: float = Field(gt=0, le=60)
    timeout_register: Address | None = None
    """Holding register for `timeout_s`, if it can be set over Modbus."""
    timeout_unit_s: float = Field(default=1e-3, gt=0, le=1)
    trigger_register: Address | None = None
    """Holding register that must be written repeatedly with changing values; without one, any
    valid request resets the watchdog."""

    @model_validator(mode="after")
    def _fits_a_register(self) -> Self:
        if not 1 <= round(self.timeout_s / self.timeout_unit_s) <= 0xFFFF:
            raise ValueError(
                f"timeout_s: value {self.timeout_s}; allowed: 1 to 65535 times timeout_unit_s "
                f"({self.timeout_unit_s})"
            )
        return self


class SafetyIoProfile(Profile):
    """One remote I/O and how it is wired."""

    name: str = Field(min_length=1)
    notes: tuple[str, ...] = ()
    host: str = Field(min_length=1)
    port: int = Field(default=502, ge=1, le=65535)
    unit: int = Field(default=1, ge=0, le=255)
    poll_period_s: float = Field(default=0.02, ge=0.002, le=1)
    answer_timeout_s: float = Field(default=0.05, ge=0.005, le=5)
    trip_timeout_s: float = Field(default=0.1, ge=0.01, le=5)
    """Time without a valid poll after which the motion is stopped."""
    chain: DigitalInput
    """The emergency-stop chain: true while it is closed, which allows power."""
    contactor: Contactor
    axes: tuple[AxisPoints, ...] = ()
    lights: Lights = Lights()
    watchdog: DeviceWatchdog | None = None

    def inputs(self) -> Iterator[tuple[str, DigitalInput]]:
        """Yield every input with its key."""
        yield "chain", self.chain
        yield "contactor.feedback", self.contactor.feedback
        for i, axis in enumerate(self.axes):
            if axis.brake is not None:
                yield f"axes[{i}].brake.feedback", axis.brake.feedback
            for name, point in axis.limits():
                yield f"axes[{i}].limit_{name}", point

    def outputs(self) -> Iterator[tuple[str, DigitalOutput]]:
        """Yield every output with its key."""
        yield "contactor.output", self.contactor.output
        for i, axis in enumerate(self.axes):
            if axis.brake is not None:
                yield f"axes[{i}].brake.output", axis.brake.output
        for colour, output in self.lights.items():
            yield f"lights.{colour}", output

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        _once([(key, point.input) for key, point in self.inputs()], "input")
        _once([(key, point.coil) for key, point in self.outputs()], "coil")
        for key, output in self.outputs():
            if output.inverted and not key.startswith("lights."):
                raise ValueError(
                    f"{key}.inverted: value True; allowed: False, because without supply a "
                    "contactor must open and a brake must hold"
                )
        for key in ("axis", "node_id"):
            values = [getattr(axis, key) for axis in self.axes if getattr(axis, key) is not None]
            require_unique(f"axes: {key}", values)
        if self.trip_timeout_s < 2 * self.poll_period_s:
            raise ValueError(
                f"trip_timeout_s: value {self.trip_timeout_s}; allowed: at least two poll periods "
                f"({2 * self.poll_period_s:g})"
            )
        if self.watchdog is not None and self.watchdog.timeout_s < 2 * self.poll_period_s:
            raise ValueError(
                f"watchdog.timeout_s: value {self.watchdog.timeout_s}; allowed: at least two poll "
                f"periods ({2 * self.poll_period_s:g})"
            )
        return self


def _once(points: list[tuple[str, int]], what: str) -> None:
    """Raise ValueError for an address that is used twice, or too far from the others."""
    owners: dict[int, str] = {}
    for key, address in points:
        if address in owners:
            raise ValueError(
                f"{key}: {what} {address} is already used by {owners[address]}; allowed: each "
                f"{what} once"
            )
        owners[address] = key
    if max(owners) - min(owners) >= MOST_POINTS:
        raise ValueError(
            f"{owners[max(owners)]}: {what} {max(owners)}; allowed: less than {MOST_POINTS} from "
            f"the first ({min(owners)}), so that one request reads all"
        )


def load_safety_io(name: str | Path) -> SafetyIoProfile:
    """Return a safety I/O by name or path; raises ProfileError.

    NAME@HOST or NAME@HOST:PORT is the same profile at another address.
    """
    text, at, place = str(name).partition("@")
    path = require("safety_io", text)
    if not at:
        return read_toml_model(path, SafetyIoProfile)
    host, colon, port = place.rpartition(":") if ":" in place else (place, "", "")
    moved = {"host": host} | ({"port": _number(port, path)} if colon else {})
    return validated(path, read_toml(path) | moved, SafetyIoProfile)


def _number(text: str, path: Path) -> int:
    if not text.isdecimal():
        raise ProfileError(path, "port", f"value {text!r}; allowed: a number from 1 to 65535")
    return int(text)
