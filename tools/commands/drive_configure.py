"""`cdpr drive configure|errors`: a drive's configuration, and the errors it remembers."""

from __future__ import annotations

from typing import Annotated

import typer

from drivers.boot import boot
from drivers.emergency import register_text
from drivers.errors import SdoError
from profiles import load_winch
from tools.commands.options import BusOption, JsonOption, PlantOption, WinchArgument
from tools.errors import WorkFailedError
from tools.output import Output
from tools.robot_boot import boot_settings
from tools.session import open_bus, open_network


def add(drive: typer.Typer) -> None:
    """Add the commands to the group `cdpr drive`."""
    drive.command()(configure)
    drive.command()(errors)


def configure(
    winch: WinchArgument,
    bus: BusOption,
    plant: PlantOption = None,
    store: Annotated[
        bool, typer.Option("--store", help="have the drive keep it over a power cycle (1010h)")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Write into the drive what differs from its profile; nothing is enabled."""
    out = Output(as_json)
    profile = load_winch(winch)
    node = profile.node_id
    with open_network(profile, open_bus(bus), out, plant) as network:
        settings = boot_settings(profile, profile.motor.rated_torque_Nm)
        report = boot(network, node, profile.drive, settings, store_configuration=store)
        network.release(node)
    for change in report.changed:
        out.say(f"written: {change}")
    for absent in report.absent:
        out.say(f"not there: {absent}")
    if report.vouched:
        out.say("the drive holds this configuration stored (1020h)")
    elif not report.changed:
        out.say("nothing differs")
    if store and not (report.stored or report.vouched):
        raise WorkFailedError(f"node {node} has no object 1010h: it cannot store its configuration")
    if report.stored:
        out.say("stored")
    out.result(
        {
            "ok": True,
            "node_id": node,
            "changed": report.changed,
            "absent": report.absent,
            "vouched": report.vouched,
            "stored": report.stored,
        }
    )


def errors(
    winch: WinchArgument, bus: BusOption, plant: PlantOption = None, as_json: JsonOption = False
) -> None:
    """Show the errors that a drive remembers (1003h), the newest first; reads only."""
    out = Output(as_json)
    profile = load_winch(winch)
    node = profile.node_id
    with open_network(profile, open_bus(bus), out, plant) as network:
        try:
            register = network.read_int(node, 0x1001)
            history = network.error_history(node)
        except SdoError as error:
            raise WorkFailedError(str(error)) from error
    out.say(f"error register {register:02X}h: {register_text(register)}")
    for record in history:
        more = f", manufacturer's {record.additional:04X}h" if record.additional else ""
        out.say(f"{record}{more}")
    if not history:
        out.say("no errors remembered")
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
