"""`cdpr drive configure|errors`: a drive's configuration, and the errors it remembers."""

from __future__ import annotations

from typing import Annotated

import typer

from cdpr_drivers.canopen.boot.boot import boot
from cdpr_drivers.canopen.emergency import register_text
from cdpr_drivers.errors import SdoError
from cdpr_drivers.robot.robot_boot import boot_settings
from cdpr_tools.commands.with_winch import WinchOnBus, with_winch
from cdpr_tools.errors import WorkFailedError
from cdpr_tools.output import Output

app = typer.Typer()


@app.command()
@with_winch
def configure(
    winch: WinchOnBus,
    out: Output,
    store: Annotated[
        bool, typer.Option("--store", help="have the drive keep it over a power cycle (1010h)")
    ] = False,
) -> None:
    """Write into the drive what differs from its profile; nothing is enabled."""
    profile = winch.profile
    node = profile.node_id
    with winch.network() as network:
        settings = boot_settings(profile, profile.motor.rated_torque_Nm)
        report = boot(network, node, profile.drive, settings, store_configuration=store)
        network.release(node)
    for change in report.changed:
        out.say(f"written: {change}")
    for absent in report.absent:
        out.say(f"not there: {absent}")
    if report.stamp_matched:
        out.say("the drive holds this configuration stored (1020h)")
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
    """Show the errors that a drive remembers (1003h), the newest first; reads only."""
    node = winch.profile.node_id
    with winch.network() as network:
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
