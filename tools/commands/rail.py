"""`cdpr rail`: show and move a rail; after a move the robot is not calibrated."""

from __future__ import annotations

import dataclasses
from typing import Annotated

import typer

from cdpr_drivers.robot.rail import Cia402RailAxis, MoveConditions, move
from cdpr_drivers.robot.rail_session import (
    open_rail,
    position_of,
    power_watch,
    rail_clock,
    require_options,
    slack_watch,
)
from cdpr_profiles.rail import load_rail
from cdpr_rt.model.calibration_state import calibration_state
from cdpr_tools.commands.options import JsonOption, SafetyIoOption, YesOption, argument, option
from cdpr_tools.consent import require_consent
from cdpr_tools.errors import BadInputError
from cdpr_tools.output import Output
from cdpr_tools.signals import stop_on_signals

app = typer.Typer(name="rail", help="Move the rails that carry the winches.", no_args_is_help=True)

_RailArgument = Annotated[
    str, argument("Rail profile: a name or the path of a file.", metavar="RAIL")
]
_BusOption = Annotated[
    str | None,
    option(
        "CAN bus of a rail on CiA 402: simbus:NAME, socketcan:can0, ...", "--bus", metavar="URL"
    ),
]


@app.command()
def show(rail: _RailArgument, bus: _BusOption = None, as_json: JsonOption = False) -> None:
    """Show the carriage's position and whether the robot is calibrated; moves nothing."""
    out = Output(as_json)
    profile = load_rail(rail)
    position = position_of(rail, profile, bus)
    state = calibration_state(profile.robot)
    out.say(f"{profile.name}: {position:z.4f} m")
    known = "calibrated" if state.calibrated else "NOT calibrated"
    since = f" since {state.date}" if state.date else ""
    out.say(f"robot {state.robot}: {known}{since}: {state.why}")
    calibration = dataclasses.asdict(state)
    out.result({"ok": True, "position_m": position, "calibration": calibration})


@app.command()
def reset(
    rail: _RailArgument,
    bus: _BusOption = None,
    safety_io: SafetyIoOption = None,
    as_json: JsonOption = False,
) -> None:
    """Acknowledge the fault of a rail's CiA 402 drive; this enables nothing."""
    out = Output(as_json)
    profile = load_rail(rail)
    with (
        rail_clock(profile, bus, ()) as clock,
        open_rail(rail, profile, bus, safety_io, out, clock) as axis,
    ):
        if not isinstance(axis, Cia402RailAxis):
            raise BadInputError(f"{profile.name}: acknowledge its fault at the drive itself")
        axis.acknowledge_fault()
    out.say(f"{profile.name}: no fault")
    out.result({"ok": True})


@app.command("move")
def move_(
    rail: _RailArgument,
    to_m: Annotated[float, option("Target position, in m.", "--to", metavar="M")],
    bus: _BusOption = None,
    safety_io: SafetyIoOption = None,
    sensors: Annotated[
        str | None, option("Tension sensors, to check that the cables are slack.")
    ] = None,
    tension_port: Annotated[
        str | None, option("Serial line of the tension sensors.", metavar="TTY")
    ] = None,
    cables_slack_checked: Annotated[
        bool, option("Confirm that you have seen all cables hang slack.", "--cables-slack-checked")
    ] = False,
    winch_bus: Annotated[
        list[str] | None,
        option(
            "Another CAN bus with winches, whose drives must have no power; may be repeated.",
            metavar="URL",
        ),
    ] = None,
    yes: YesOption = False,
    as_json: JsonOption = False,
) -> None:
    """Move a rail, with slack cables and a tested brake; then the robot is no longer calibrated."""
    out = Output(as_json)
    profile = load_rail(rail)
    if not profile.travel_min_m <= to_m <= profile.travel_max_m:
        raise BadInputError(
            f"--to {to_m:g}: allowed: {profile.travel_min_m:g} to {profile.travel_max_m:g} m"
        )
    require_options(profile, bus, safety_io)
    simulated = profile.cia402 is not None and bus is not None and bus.startswith("simbus:")
    if not simulated:
        question = f"{profile.name} moves to {to_m:g} m; robot {profile.robot} must be calibrated"
        require_consent(f"{question} again.", yes)
    with (
        stop_on_signals() as stop_requested,
        rail_clock(profile, bus, winch_bus or ()) as clock,
        slack_watch(profile, sensors, tension_port, cables_slack_checked, clock) as cables_tight,
        power_watch(profile, bus, winch_bus or (), out, clock) as powered,
        open_rail(rail, profile, bus, safety_io, out, clock) as axis,
    ):
        travel_s = abs(to_m - axis.position_m()) / profile.speed_m_s
        begun = axis.position_m()
        with out.progress(f"moving {profile.name}", travel_s) as advance:
            done = move(
                profile,
                axis,
                clock,
                to_m,
                MoveConditions(
                    cables_tight,
                    powered,
                    stop_requested,
                    lambda here: advance(abs(here - begun) / profile.speed_m_s),
                ),
            )
    out.say(f"{profile.name}: from {done.from_m:z.4f} m to {done.to_m:z.4f} m, braked")
    if done.brake_moved_m is None:
        out.say("the brake was not tested: this drive cannot push")
    out.say(f"robot {profile.robot} is no longer calibrated")
    out.result({"ok": True, **dataclasses.asdict(done), "robot": profile.robot})
