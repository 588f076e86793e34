"""`cdpr drive`: look at one drive, enable it, find its index, turn it, read its objects."""

from __future__ import annotations

import math
from typing import Annotated, Any

import numpy as np
import typer

from cdpr_rt.controllers.pid import Pid
from cdpr_rt.trajectory import Leg
from cdpr_rt.tuning import stiffest_pid
from drivers.cia402 import State, fault_text, mode_bits, mode_name, state_of, supported_modes
from drivers.errors import SdoError
from drivers.network import CanNetwork
from profiles import Winch, load_winch
from tools.commands import drive_configure, drive_setup
from tools.commands.options import (
    BusOption,
    JsonOption,
    PlantOption,
    SafetyIoOption,
    SensorsOption,
    SensorsPortOption,
    WinchArgument,
    YesOption,
)
from tools.errors import BadInputError, WorkFailedError
from tools.output import Output
from tools.session import (
    Session,
    Tolerance,
    confirm_motion,
    open_bus,
    open_network,
    open_winch,
)
from tools.tension.session_watch import tension_watch

app = typer.Typer(help="One drive on the bus.", no_args_is_help=True)

_JOG_RAMP_S = 0.5
_JOG_HZ = (20.0, 15.0, 12.0, 8.0, 5.0)
_TORQUE_SHARE = 0.25
_START_UP_LOOK_S = 0.01
# a motor that turns the wrong way is to be stopped before half a turn
_JOG_ERROR_RAD = 2.5
_JOG_SPEEDS, _JOG_LEAST_RAD_S = 4.0, 40.0


def register(parent: typer.Typer) -> None:
    """Add the command group."""
    drive_setup.add(app)
    drive_configure.add(app)
    parent.add_typer(app, name="drive")


@app.command()
def info(
    winch: WinchArgument, bus: BusOption, plant: PlantOption = None, as_json: JsonOption = False
) -> None:
    """Say who the drive is and how it is; reads only."""
    out = Output(as_json)
    profile = load_winch(winch)
    node = profile.node_id
    with open_network(profile, open_bus(bus), out, plant) as network:
        try:
            vendor, product, revision, serial = (
                network.read_int(node, 0x1018, sub) for sub in (1, 2, 3, 4)
            )
        except SdoError as error:
            raise WorkFailedError(f"the drive does not answer: {error}") from error
        rated_Nm = profile.motor.rated_torque_Nm

        def read_if_there(index: int, sub: int, otherwise: int) -> int:
            there = index in network.dictionary(node)
            return network.read_int(node, index, sub) if there else otherwise

        has_name = 0x1008 in network.dictionary(node)
        told: dict[str, Any] = {
            "node_id": node,
            "device_name": str(network.read(node, 0x1008)) if has_name else "",
            "vendor_id": vendor,
            "product_code": product,
            "revision": revision,
            "serial": serial,
            "state": _state(network, profile).label,
            "error": fault_text(network.read_int(node, 0x603F)),
            "mode": mode_name(network.read_int(node, 0x6061)),
            "supported_modes": [
                mode_name(mode)
                for mode in supported_modes(
                    read_if_there(0x6502, 0, mode_bits(profile.drive.supported_modes))
                )
            ],
            "position_counts": network.read_int(node, 0x6064),
            "rated_torque_Nm": 1e-3 * read_if_there(0x6076, 0, round(1e3 * rated_Nm)),
            "encoder_counts_per_turn": read_if_there(0x608F, 1, profile.encoder_counts_per_turn),
        }
    wanted = profile.drive
    told["profile_fits"] = (vendor, product) == (wanted.vendor_id, wanted.product_code)
    for key, value in told.items():
        shown = f"{value:08X}h" if key in ("vendor_id", "product_code", "revision") else value
        shown = ", ".join(value) if isinstance(value, list) else shown
        out.say(f"{key:24}{shown}")
    out.result({"ok": True, **told})


def _state(network: CanNetwork, profile: Winch) -> State:
    """Return the drive's state, once it has started up if it does so within the usual time."""
    clock = network.clock
    until_s = clock.now_s + profile.drive.state_timeout_s
    while True:
        state = state_of(network.read_int(profile.node_id, 0x6041))
        if state is not State.NOT_READY or clock.now_s >= until_s:
            return state
        clock.sleep(_START_UP_LOOK_S)


@app.command()
def enable(
    winch: WinchArgument,
    bus: BusOption,
    plant: PlantOption = None,
    seconds: Annotated[float, typer.Option(min=0.1, max=600.0)] = 2.0,
    safety_io: SafetyIoOption = None,
    sensors: SensorsOption = None,
    port: SensorsPortOption = None,
    yes: YesOption = False,
    as_json: JsonOption = False,
) -> None:
    """Enable the drive in torque mode without torque for a while, then switch it off."""
    out = Output(as_json)
    profile, url = load_winch(winch), open_bus(bus)
    confirm_motion(url, yes, "the drive's power stage is switched on")
    watching = tension_watch(sensors, port)
    opened = open_winch(profile, url, out, plant, safety_io=safety_io, watching=watching)
    with opened as session:
        session.enable()
        out.say(f"{session.device.states()[0].label}, no torque")
        session.idle(seconds)
        session.disable()
        state = session.device.states()[0].label
        out.say(state)
    out.result({"ok": True, "state": state})


@app.command()
def reset(
    winch: WinchArgument,
    bus: BusOption,
    plant: PlantOption = None,
    safety_io: SafetyIoOption = None,
    as_json: JsonOption = False,
) -> None:
    """Acknowledge the drive's fault; nothing is enabled by it."""
    out = Output(as_json)
    profile = load_winch(winch)
    opened = open_winch(profile, open_bus(bus), out, plant, safety_io=safety_io, reset=True)
    with opened as session:
        state = session.device.states()[0].label
    out.say(state)
    out.result({"ok": True, "state": state})


@app.command()
def home(
    winch: WinchArgument,
    bus: BusOption,
    plant: PlantOption = None,
    method: Annotated[
        int, typer.Option(help="Homing method of CiA 402: 33, 34, 37, 35, 1 to 14.")
    ] = 34,
    safety_io: SafetyIoOption = None,
    sensors: SensorsOption = None,
    port: SensorsPortOption = None,
    yes: YesOption = False,
    as_json: JsonOption = False,
) -> None:
    """Find the encoder index by homing; the motor turns by up to a turn."""
    out = Output(as_json)
    profile, url = load_winch(winch), open_bus(bus)
    known = profile.drive.homing_methods
    if method not in known:
        raise BadInputError(
            f"--method {method}: {profile.drive.name} has {', '.join(map(str, known))}"
        )
    confirm_motion(url, yes, "homing turns the motor by up to a turn")
    watching = tension_watch(sensors, port)
    opened = open_winch(profile, url, out, plant, safety_io=safety_io, watching=watching)
    with opened as session:
        session.find_index(method)
        position = math.degrees(session.device.feedback.position_rad[0])
        out.say(f"homed by method {method}; the motor stands {position:.2f} deg from there")
    out.result({"ok": True, "method": method, "position_deg": position})


@app.command()
def jog(
    winch: WinchArgument,
    bus: BusOption,
    plant: PlantOption = None,
    speed_deg_s: Annotated[
        float, typer.Option("--speed-deg-s", help="Motor speed; its sign is the direction.")
    ] = 22.0,
    seconds: Annotated[float, typer.Option(min=0.1, max=600.0)] = 3.0,
    safety_io: SafetyIoOption = None,
    sensors: SensorsOption = None,
    port: SensorsPortOption = None,
    yes: YesOption = False,
    as_json: JsonOption = False,
) -> None:
    """Turn the motor at a constant speed under the PID, then switch it off."""
    out = Output(as_json)
    profile, url = load_winch(winch), open_bus(bus)
    fastest = 0.1 * math.degrees(profile.motor.rated_speed_rad_s)
    if not 0.0 < abs(speed_deg_s) <= fastest:
        raise BadInputError(
            f"--speed-deg-s {speed_deg_s:g}: allowed are up to {fastest:.0f} deg/s, not 0"
        )
    confirm_motion(url, yes, f"the motor turns at {speed_deg_s:g} deg/s for {seconds:g} s")
    watching = tension_watch(sensors, port)
    speed = math.radians(speed_deg_s)
    tolerance = Tolerance(_JOG_ERROR_RAD, max(_JOG_SPEEDS * abs(speed), _JOG_LEAST_RAD_S))
    opened = open_winch(
        profile, url, out, plant, safety_io=safety_io, watching=watching, tolerance=tolerance
    )
    with opened as session:
        session.enable()
        start = session.device.feedback.position_rad.copy()
        leg = Leg(start, np.array([speed]), seconds, _JOG_RAMP_S)
        session.follow(_jog_controller(session), leg)
        moved = math.degrees(session.device.feedback.position_rad[0] - start[0])
        session.disable()
    out.say(f"turned by {moved:.2f} deg")
    out.result({"ok": True, "moved_deg": moved})


def _jog_controller(session: Session) -> Pid:
    motor, period = session.winch.motor, session.device.period_s
    # a soft loop lets a rotor with friction stick and slip: by turns at these speeds
    design = stiffest_pid(motor.rotor_inertia_kg_m2, session.winch.latency_s, _JOG_HZ, period)
    return Pid([design.gains], np.array([_TORQUE_SHARE * motor.rated_torque_Nm]), period)


@app.command()
def od(
    winch: WinchArgument,
    bus: BusOption,
    entry: Annotated[str, typer.Argument(help="Object, as 6064 or 1018:1, hexadecimal.")],
    plant: PlantOption = None,
    value: Annotated[
        str | None, typer.Option("--set", help="Write this integer (0x.. for hexadecimal).")
    ] = None,
    yes: YesOption = False,
    as_json: JsonOption = False,
) -> None:
    """Read or write an object of the drive's dictionary."""
    out = Output(as_json)
    profile, url = load_winch(winch), open_bus(bus)
    index, sub = _object(entry)
    with open_network(profile, url, out, plant) as network:
        if value is not None:
            try:
                number = int(value, 0)
            except ValueError:
                raise BadInputError(f"--set {value}: an integer is wanted, as 12 or 0x0C") from None
            confirm_motion(url, yes, f"object {index:04X}h:{sub} is set to {number}")
            network.write(profile.node_id, index, sub, number)
        read = network.read(profile.node_id, index, sub)
    shown = f"{read} ({read:X}h)" if isinstance(read, int) and read >= 0 else repr(read)
    out.say(f"{index:04X}h:{sub} = {shown}")
    plain = read.hex() if isinstance(read, bytes) else read
    out.result({"ok": True, "index": index, "subindex": sub, "value": plain})


def _object(text: str) -> tuple[int, int]:
    index, _, sub = text.lower().removeprefix("0x").partition(":")
    try:
        numbers = int(index, 16), int(sub or "0", 16)
    except ValueError:
        numbers = -1, -1
    if not (0 < numbers[0] <= 0xFFFF and 0 <= numbers[1] <= 0xFF):
        raise BadInputError(f"object {text!r}: write it as 6064 or 1018:1, hexadecimal")
    return numbers
