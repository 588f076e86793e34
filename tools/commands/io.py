"""`cdpr io`: show a safety I/O, try its lamps and brakes by hand, acknowledge a trip."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from typing import Annotated, Any

import typer

from cdpr_drivers.modbus.channel import ModbusError
from cdpr_drivers.modbus.safety_io import IoLink, IoState
from cdpr_drivers.robot.safety import connect, kept_trip
from cdpr_profiles.safety_io import Brake, Contactor, load_safety_io
from cdpr_rt.core.clock import PacedClock
from cdpr_tools.commands.options import JsonOption, YesOption, argument, option
from cdpr_tools.consent import require_consent
from cdpr_tools.errors import BadInputError, WorkFailedError
from cdpr_tools.output import Output
from cdpr_tools.signals import stop_on_signals

app = typer.Typer(name="io", help="Show and test the safety I/O.", no_args_is_help=True)

_IoArgument = Annotated[str, argument("Profile: a name, a file, NAME@HOST:PORT.", metavar="IO")]
_Seconds = Annotated[float, option("Duration; Ctrl-C ends it early.", min=0.1, max=86400.0)]


@app.command()
def show(io: _IoArgument, as_json: JsonOption = False) -> None:
    """Show the value of every point; changes nothing."""
    out = Output(as_json)
    with _link(io) as link:
        state = link.state()
    kept = kept_trip(io)
    out.say(*_lines(state))
    if kept is not None:
        out.say(f"tripped on {kept.get('date')}: {kept.get('reason')} (cdpr io ack {io})")
    out.result({"ok": True, **_as_dict(state), "trip": kept})


@app.command()
def watch(io: _IoArgument, seconds: _Seconds = 3600.0, as_json: JsonOption = False) -> None:
    """Show each change as it happens; changes nothing."""
    out = Output(as_json)
    before: list[str] = []
    # an interrupt inside a print could print the line twice
    with _link(io) as link, stop_on_signals() as stop_requested:
        clock = link.clock
        deadline_s = clock.now_s + seconds
        while True:
            state = link.state()
            lines = _lines(state)
            for line in lines:
                if line not in before:
                    out.say(f"{time.strftime('%H:%M:%S')}  {line}")
            before = lines
            if stop_requested() or clock.now_s >= deadline_s:
                break
            clock.sleep(link.profile.poll_period_s)
        if stop_requested():
            out.note("stopped on request")
    out.result({"ok": True, **_as_dict(state)})


@app.command()
def light(
    io: _IoArgument,
    colour: Annotated[str, argument("red, yellow, green, blue or white.")],
    seconds: _Seconds = 3.0,
    as_json: JsonOption = False,
) -> None:
    """Switch one colour of the stack light on for a while."""
    out = Output(as_json)
    with _link(io) as link:
        lights = {str(known): output for known, output in link.profile.lights.items()}
        lamp = lights.get(colour)
        if lamp is None:
            raise BadInputError(f"colour {colour!r}; {io} has {', '.join(lights) or 'no lights'}")
        link.set_watchdog()
        try:
            _keep(link, lamp.coil, not lamp.inverted, seconds)
            if not link.state().lights[colour]:
                raise WorkFailedError(f"{colour} was set, but output {lamp.coil} does not show it")
        except KeyboardInterrupt:
            out.note("stopped on request")
        finally:
            link.write(lamp.coil, lamp.inverted)
    out.say(f"{colour} was on, output {lamp.coil}")
    out.result({"ok": True, "colour": colour})


@app.command()
def brake(
    io: _IoArgument,
    axis: Annotated[str, argument("Axis, as the profile calls it.")],
    seconds: _Seconds = 5.0,
    yes: YesOption = False,
    as_json: JsonOption = False,
) -> None:
    """Release a brake by hand for a while, then apply it; reports whether its feedback follows."""
    out = Output(as_json)
    with _link(io) as link:
        brakes = {a.axis: a.brake for a in link.profile.axes if a.brake is not None}
        one = brakes.get(axis)
        if one is None:
            known = ", ".join(repr(name) for name in brakes) or "none"
            raise BadInputError(f"axis {axis!r} has no brake in {io}; with one: {known}")
        state = link.state()
        if state.contactor_asked or any(state.brakes_asked.values()):
            raise WorkFailedError(
                f"{link.name}: its outputs for contactor or brakes are on: wait until the command "
                "that uses it ends; if that command has died, use cdpr io off"
            )
        require_consent(f"Then only its drive holds {axis}.", yes)
        link.set_watchdog()
        with stop_on_signals() as stop_requested:
            try:
                _hold(link, axis, one, True, one.timeout_s, stop_requested)
                if not stop_requested():
                    out.say(f"the brake of {axis} is released")
                    _hold(link, axis, one, True, seconds, stop_requested)
                if stop_requested():
                    out.note("stopped on request")
            finally:
                link.write(one.output.coil, False)  # before anything else can go wrong
                _hold(link, axis, one, False, one.timeout_s)
        out.say(f"the brake of {axis} is applied")
    out.result({"ok": True, "axis": axis})


@app.command()
def off(io: _IoArgument, as_json: JsonOption = False) -> None:
    """Open the contactor and apply all brakes, also those that another command has set."""
    out = Output(as_json)
    with _link(io) as link:
        brakes = [axis.brake for axis in link.profile.axes if axis.brake is not None]
        devices: list[Brake | Contactor] = [*brakes, link.profile.contactor]
        refused = []
        for device in devices:  # try each, even if others failed
            try:
                link.write(device.output.coil, False)
            except ModbusError as error:
                refused.append(str(error))
        if refused:
            raise WorkFailedError("; ".join(dict.fromkeys(refused)))
        link.clock.sleep(max(device.timeout_s for device in devices))
        state = link.state()
    out.say(*_lines(state))
    if state.contactor_closed or any(state.brakes_released.values()):
        raise WorkFailedError(f"{link.name}: contactor or brakes do not follow their outputs")
    out.result({"ok": True, **_as_dict(state)})


@app.command()
def ack(io: _IoArgument, as_json: JsonOption = False) -> None:
    """Acknowledge a trip whose cause is gone; this energises nothing."""
    out = Output(as_json)
    kept = kept_trip(io)
    with connect(io, PacedClock()) as safety:
        safety.acknowledge()
    out.say("no trip to acknowledge" if kept is None else f"acknowledged: {kept.get('reason')}")
    out.result({"ok": True, "acknowledged": kept})


@contextmanager
def _link(io: str) -> Iterator[IoLink]:
    link = IoLink(load_safety_io(io), PacedClock())
    try:
        yield link
    finally:
        link.close()


def _hold(
    link: IoLink,
    axis: str,
    brake: Brake,
    released: bool,
    seconds: float,
    ended: Callable[[], bool] = lambda: False,
) -> None:
    """Keep a brake's output for a while; raises WorkFailedError unless its feedback follows."""
    _keep(link, brake.output.coil, released, seconds, ended)
    if ended():
        return
    if link.state().brakes_released[axis] != released:
        wanted = "released" if released else "applied"
        raise WorkFailedError(
            f"the brake of {axis} is not {wanted} {brake.timeout_s:g} s after output "
            f"{brake.output.coil} was set to {int(released)} (input {brake.feedback.input})"
        )


def _keep(
    link: IoLink,
    coil: int,
    on: bool,
    seconds: float,
    ended: Callable[[], bool] = lambda: False,
) -> None:
    """Set an output and feed the device's watchdog for a while."""
    link.feed_watchdog()  # a device whose watchdog has expired accepts no outputs
    link.write(coil, on)
    deadline_s = link.clock.now_s + seconds
    while link.clock.now_s < deadline_s and not ended():
        link.feed_watchdog()
        link.clock.sleep(link.profile.poll_period_s)


def _as_dict(state: IoState) -> dict[str, Any]:
    return {key: value for key, value in asdict(state).items() if key != "at_s"}


def _lines(state: IoState) -> list[str]:
    def follows(asked: bool, is_so: bool) -> str:
        return "" if asked == is_so else "  <- does not follow its output"

    closed = "closed" if state.contactor_closed else "open"
    lines = [
        f"emergency-stop chain  {'closed (ok)' if state.chain_ok else 'OPEN'}",
        f"contactor             {closed}{follows(state.contactor_asked, state.contactor_closed)}",
    ]
    for axis, released in state.brakes_released.items():
        text = "released" if released else "applied"
        lines.append(f"brake of {axis:13}{text}{follows(state.brakes_asked[axis], released)}")
    lines += list(state.limits) or ["limit switches        none reached"]
    lit = [colour for colour, on in state.lights.items() if on]
    lines.append(f"stack light           {', '.join(lit) or 'dark'}")
    return lines
