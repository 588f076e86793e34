"""`cdpr bus budget`: whether a machine's cycle fits its buses."""

from __future__ import annotations

import math
from typing import Annotated, Any

import typer

from cdpr_drivers.bus.budget import BusBudget, machine_budget
from cdpr_drivers.robot.bus_fit import refusal
from cdpr_profiles import load_winch_or_robot
from cdpr_tools.commands.options import JsonOption
from cdpr_tools.errors import BAD_INPUT
from cdpr_tools.output import Output

_US = 1e6
_LOW, _HIGH = 1.0, 10_000.0


app = typer.Typer()


@app.command()
def budget(
    machine: Annotated[
        str, typer.Argument(help="Robot or winch profile: a name or the path of a file.")
    ],
    rate: Annotated[
        float | None,
        typer.Option(min=_LOW, max=_HIGH, help="Cycles a second, instead of the profile's."),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Compute the worst-case time of the cycle on each bus, the highest rate, and what is left.

    Exit status 2 when the cycle does not fit.
    """
    out = Output(as_json)
    profile = load_winch_or_robot(machine)
    period_s = None if rate is None else 1.0 / rate
    budgets = machine_budget(profile, period_s)
    out.say(*_report(profile.name, budgets))
    reason = refusal(budgets)
    figures = {"rate_Hz": 1.0 / budgets[0].period_s, "buses": [_figures(b) for b in budgets]}
    if reason:
        typer.echo(f"cdpr: {profile.path}: {reason}", err=True)
        out.result({"ok": False, "error": reason, "exit_status": BAD_INPUT, **figures})
        raise typer.Exit(BAD_INPUT)
    out.result({"ok": True, **figures})


def _figures(budget: BusBudget) -> dict[str, Any]:
    return {
        "bus": budget.bus,
        "bitrate_bit_s": budget.bitrate_bit_s,
        "nodes": budget.nodes,
        "period_us": round(budget.period_s * _US, 3),
        "cycle_us": round(budget.cycle_s * _US, 3),
        "cycle_without_stuffing_us": round(budget.bare_cycle_s * _US, 3),
        "heartbeats_us_per_cycle": round(budget.heartbeat_share * budget.period_s * _US, 3),
        "margin_us": round(budget.margin_s * _US, 3),
        "cycle_limit_Hz": round(budget.cycle_limit_Hz, 2),
        "highest_rate_Hz": math.floor(budget.highest_rate_Hz * 100) / 100,
        "sdo_transfers_per_s": round(budget.sdo_transfers_s, 1),
        "changes_us": round(budget.changes_s * _US, 3),
        "changes_told_after_cycles": budget.recovery_cycles,
        "longest_wait_of_sync_us": round(budget.longest_wait_s * _US, 3),
        "fits": budget.fits,
    }


def _report(name: str, budgets: list[BusBudget]) -> list[str]:
    period_s = budgets[0].period_s
    lines = [
        f"{name} at {1.0 / period_s:.6g} Hz: {period_s * _US:.0f} us a cycle",
        f"{'bus':14}{'bit/s':>9}{'drives':>8}{'cycle, us':>11}{'unstuffed':>11}{'share':>9}"
        f"{'left, us':>10}{'highest':>10}",
    ]
    for b in budgets:
        lines.append(
            f"{b.bus:14}{b.bitrate_bit_s:9}{len(b.nodes):8}{b.cycle_s * _US:11.0f}"
            f"{b.bare_cycle_s * _US:11.0f}{b.cycle_s / b.period_s:9.1%}"
            f"{b.margin_s * _US:10.1f}{math.floor(b.highest_rate_Hz):7} Hz"
        )
    return lines + [_explanation(b) for b in budgets if b.fits]


def _explanation(b: BusBudget) -> str:
    """Say what the time left over has to serve."""
    text = (
        f"{b.bus}: heartbeats take {b.heartbeat_share * b.period_s * _US:.1f} us a cycle; what is "
        f"left is for computing, EMCY and {b.sdo_transfers_s:.0f} SDO transfers a second"
    )
    if b.changes_s and math.isfinite(b.recovery_cycles):
        cycles = f"{b.recovery_cycles:.0f} cycle{'s' if b.recovery_cycles > 1 else ''}"
        text += f", and tells a change in every drive within {cycles}"
    return text + f"; SYNC may come up to {b.longest_wait_s * _US:.0f} us late"
