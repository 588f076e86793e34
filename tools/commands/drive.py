"""`cdpr drive`: show one drive, enable it, find its index, turn it, read its objects."""

from __future__ import annotations

import math
from typing import Annotated, Any

import numpy as np
import typer

from cdpr_drivers.canopen.boot import boot
from cdpr_drivers.canopen.emergency import register_text
from cdpr_drivers.canopen.network import CanNetwork
from cdpr_drivers.cia402 import State, fault_text, mode_bits, mode_name, state_of, supported_modes
from cdpr_drivers.errors import SdoError
from cdpr_drivers.robot.robot_boot import boot_settings
from cdpr_profiles import Winch
from cdpr_rt.control.pid import Pid
from cdpr_rt.loop.operating import Tolerance
from cdpr_rt.motion.trajectory import TrapezoidalMove
from cdpr_rt.programs.model import position_loop
from cdpr_tools.commands.options import SafetyIoOption, YesOption, argument, option
from cdpr_tools.commands.with_winch import WinchOnBus, with_powered_winch, with_winch
from cdpr_tools.composition.session import Session, confirm_motion, open_winch
from cdpr_tools.errors import BadInputError, WorkFailedError, raised_as
from cdpr_tools.output import Output

app = typer.Typer()

_JOG_RAMP_S = 0.5
_JOG_SETTLE_S = 1.0
_TORQUE_SHARE = 0.25
_START_UP_LOOK_S = 0.01
# a motor that turns the wrong way must be stopped within half a turn
_JOG_ERROR_RAD = 2.5
_JOG_SPEEDS, _JOG_LEAST_RAD_S = 4.0, 40.0


@app.command()
@with_winch
def info(winch: WinchOnBus, out: Output) -> None:
    """Show the drive's identity and state; reads only."""
    profile = winch.profile
    node = profile.node_id
    with winch.network() as network:
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
        identity: dict[str, Any] = {
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
    drive = profile.drive
    identity["profile_fits"] = (vendor, product) == (drive.vendor_id, drive.product_code)
    for key, value in identity.items():
        shown = f"{value:08X}h" if key in ("vendor_id", "product_code", "revision") else value
        shown = ", ".join(value) if isinstance(value, list) else shown
        out.say(f"{key:24}{shown}")
    out.result({"ok": True, **identity})


def _state(network: CanNetwork, profile: Winch) -> State:
    """Return the drive's state; wait the usual time for its start-up."""
    clock = network.clock
    until_s = clock.now_s + profile.drive.state_timeout_s
    while True:
        state = state_of(network.read_int(profile.node_id, 0x6041))
        if state is not State.NOT_READY or clock.now_s >= until_s:
            return state
        clock.sleep(_START_UP_LOOK_S)


@app.command()
@with_powered_winch
def enable(
    winch: WinchOnBus,
    out: Output,
    seconds: Annotated[float, option("For how long.", min=0.1, max=600.0)] = 2.0,
) -> None:
    """Enable the drive in torque mode without torque for a while, then switch it off."""
    with winch.powered("the drive's power stage is switched on") as session:
        session.enable()
        out.say(f"{session.device.states()[0].label}, no torque")
        session.idle(seconds)
        session.disable()
        state = session.device.states()[0].label
        out.say(state)
    out.result({"ok": True, "state": state})


@app.command()
@with_winch
def reset(winch: WinchOnBus, out: Output, safety_io: SafetyIoOption = None) -> None:
    """Acknowledge the drive's fault; the power stays off."""
    opened = open_winch(winch.profile, winch.url, out, winch.plant, safety_io=safety_io, reset=True)
    with opened as session:
        state = session.device.states()[0].label
    out.say(state)
    out.result({"ok": True, "state": state})


@app.command()
@with_powered_winch
def home(
    winch: WinchOnBus,
    out: Output,
    method: Annotated[int, option("Homing method of CiA 402: 33, 34, 37, 35, 1 to 14.")] = 34,
) -> None:
    """Find the encoder index by homing; the motor turns by up to a turn."""
    drive = winch.profile.drive
    if method not in drive.homing_methods:
        known = ", ".join(map(str, drive.homing_methods))
        raise BadInputError(f"--method {method}: {drive.name} allows only: {known}")
    with winch.powered("homing turns the motor by up to a turn") as session:
        session.find_index(method)
        position = math.degrees(session.device.feedback.position_rad[0])
        out.say(f"homed by method {method}; the motor is {position:.2f} deg from the origin")
    out.result({"ok": True, "method": method, "position_deg": position})


@app.command()
@with_powered_winch
def jog(
    winch: WinchOnBus,
    out: Output,
    speed_deg_s: Annotated[
        float, option("Motor speed; its sign is the direction.", "--speed-deg-s")
    ] = 22.0,
    seconds: Annotated[float, option("For how long.", min=0.1, max=600.0)] = 3.0,
) -> None:
    """Turn the motor at a constant speed under the PID, then switch it off."""
    fastest = 0.1 * math.degrees(winch.profile.motor.rated_speed_rad_s)
    if not 0.0 < abs(speed_deg_s) <= fastest:
        raise BadInputError(
            f"--speed-deg-s {speed_deg_s:g}: allowed: up to {fastest:.0f} deg/s, not 0"
        )
    speed = math.radians(speed_deg_s)
    tolerance = Tolerance(_JOG_ERROR_RAD, max(_JOG_SPEEDS * abs(speed), _JOG_LEAST_RAD_S))
    what = f"the motor turns at {speed_deg_s:g} deg/s for {seconds:g} s"
    with winch.powered(what, tolerance) as session:
        session.enable()
        start = session.device.feedback.position_rad.copy()
        # including ramps, it turns by speed times seconds
        ramp_s = min(_JOG_RAMP_S, 0.5 * seconds)
        leg = TrapezoidalMove(start, np.array([speed]), seconds - ramp_s, ramp_s, _JOG_SETTLE_S)
        session.follow(_jog_controller(session), leg)
        moved = math.degrees(session.device.feedback.position_rad[0] - start[0])
        session.disable()
    asked = speed_deg_s * seconds
    out.say(f"turned by {moved:.2f} deg; commanded {asked:g} deg")
    out.result({"ok": True, "moved_deg": moved, "asked_deg": asked})


def _jog_controller(session: Session) -> Pid:
    motor, period = session.winch.motor, session.device.period_s
    # with a soft loop, friction makes a rotor stick and slip by whole turns at these speeds
    design = position_loop(motor.rotor_inertia_kg_m2, session.winch.latency_s, period)
    most = np.array([_TORQUE_SHARE * motor.rated_torque_Nm])
    return Pid([design.gains], most, period)


@app.command()
@with_winch
def od(
    winch: WinchOnBus,
    out: Output,
    entry: Annotated[str, argument("Object, hexadecimal, such as 6064 or 1018:1.")],
    value: Annotated[
        str | None, option("Write this integer (0x.. for hexadecimal).", "--set")
    ] = None,
    yes: YesOption = False,
) -> None:
    """Read or write an object of the drive's dictionary."""
    node = winch.profile.node_id
    index, sub = _object(entry)
    with winch.network() as network:
        if value is not None:
            try:
                number = int(value, 0)
            except ValueError:
                raise BadInputError(
                    f"--set {value}: allowed: an integer, such as 12 or 0x0C"
                ) from None
            confirm_motion(winch.url, yes, f"object {index:04X}h:{sub} is set to {number}")
            network.write(node, index, sub, number)
        read = network.read(node, index, sub)
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
        raise BadInputError(f"object {text!r}: write it in hexadecimal, such as 6064 or 1018:1")
    return numbers


@app.command()
@with_winch
def configure(
    winch: WinchOnBus,
    out: Output,
    store: Annotated[
        bool, option("Store the configuration in the drive (1010h).", "--store")
    ] = False,
) -> None:
    """Write the configuration of the profile to the drive; nothing is enabled."""
    profile = winch.profile
    node = profile.node_id
    with winch.network() as network:
        settings = boot_settings(profile, profile.motor.rated_torque_Nm)
        report = boot(network, node, profile.drive, settings, store_configuration=store)
        network.release(node)
    for change in report.changed:
        out.say(f"written: {change}")
    for absent in report.absent:
        out.say(f"the drive does not have: {absent}")
    if report.stamp_matched:
        out.say("the drive has stored this configuration (1020h)")
    elif not report.changed:
        out.say("nothing differs")
    if store and not (report.stored or report.stamp_matched):
        raise WorkFailedError(f"node {node} has no object 1010h: it cannot store its configuration")
    if report.stored:
        out.say("stored")
    out.result(
        {
            "ok": True,
            "node_id": node,
            "changed": report.changed,
            "absent": report.absent,
            "vouched": report.stamp_matched,
            "stored": report.stored,
        }
    )


@app.command()
@with_winch
def errors(winch: WinchOnBus, out: Output) -> None:
    """Show the drive's stored errors (1003h), newest first; reads only."""
    node = winch.profile.node_id
    with winch.network() as network, raised_as(WorkFailedError, SdoError):
        register = network.read_int(node, 0x1001)
        history = network.error_history(node)
    out.say(f"error register {register:02X}h: {register_text(register)}")
    for record in history:
        more = f", manufacturer's {record.additional:04X}h" if record.additional else ""
        out.say(f"{record}{more}")
    if not history:
        out.say("no stored errors")
    out.result(
        {
            "ok": True,
            "node_id": node,
            "error_register": register,
            "history": [
                {"code": record.code, "text": str(record), "additional": record.additional}
                for record in history
            ],
        }
    )
