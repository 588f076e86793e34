"""`cdpr bench tension`: what a tension distribution costs, finds, and how smooth it is."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from cdpr_tools.commands.options import JsonOption
from cdpr_tools.loading import told_on_a_terminal
from cdpr_tools.output import Output

_OTHERS = {
    "daqp": "DAQP",
    "piqp": "PIQP",
    "osqp": "OSQP, its own tolerance",
    "osqp-tight": "OSQP, 1e-9",
}


app = typer.Typer()


@app.command()
def tension(
    poses: Annotated[int, typer.Option(min=500, help="Poses of each robot.")] = 10_000,
    as_json: JsonOption = False,
) -> None:
    """Measure tension distribution on poses of spatial-8 and suspended-8, feasible or not.

    Every method is asked for the same poses as the general solvers DAQP, PIQP and OSQP, in turns,
    and follows paths with as many points, on which its tensions may change by steps.
    """
    with told_on_a_terminal():
        from cdpr_tools.bench.tension import measure as tension_bench  # noqa: PLC0415  # slow to load

    out = Output(as_json)
    figures = tension_bench.measure(poses, out.say)
    for name, robot in figures["robots"].items():
        out.say(*_table(name, robot, figures))
    out.result({"ok": True, **figures})


def _table(name: str, robot: dict[str, Any], figures: dict[str, Any]) -> list[str]:
    lines = [
        "",
        f"{name}, {figures['poses']} poses",
        f"{'':26}{'processor time, us':^27}{'wall, us':^18}{'found':>9}",
        f"{'':26}{'p50':>9}{'p99':>9}{'p99.9':>9}{'p50':>9}{'p99':>9}{'%':>9}",
    ]
    for method, cpu in robot["cpu_us"].items():
        wall = robot["wall_us"][method]
        lines.append(
            f"{_OTHERS.get(method, method):26}{cpu['p50']:9.1f}{cpu['p99']:9.1f}{cpu['p99.9']:9.1f}"
            f"{wall['p50']:9.1f}{wall['p99']:9.1f}{100.0 * robot['found'][method]:9.2f}"
        )
    lines += [f"{_OTHERS[method]}: not installed" for method in robot["not_installed"]]
    lines += [
        f"{'change, where carried':30}{'N per mm of path':^27}{'steps':^20}",
        f"{'':30}{'p50':>9}{'p99':>9}{'most':>9}{'paths':>11}{'largest, N':>12}",
    ]
    for method, smooth in robot["smoothness"].items():
        steps = f"{smooth['paths_with_steps']} of {smooth['paths']}"
        lines.append(
            f"{method:30}{smooth['p50_N_mm']:9.3f}{smooth['p99_N_mm']:9.2f}"
            f"{smooth['most_N_mm']:9.1f}{steps:>11}{smooth['largest_step_N']:12.2g}"
        )
    nearest = robot["smoothness_of_the_nearest"]
    helped = 100.0 * robot["substituted"]["closed-form"]
    method = figures["in_the_cycle"]
    return [
        *lines,
        f"beyond what can be carried tensions step on {nearest['paths_with_steps']} of "
        f"{nearest['paths']} paths, by {nearest['largest_step_N']:.2g} N at most; the wrench by "
        f"{nearest['largest_step_of_the_wrench_N']:.1g} N",
        f"closed form: in {helped:.2f} % of the poses it found none where there were some",
        f"called feasible, within bounds, and missing of the wrench at most "
        f"{robot['wrench_missing_N']:.1e} N",
        f"{method}: p99 {robot['cpu_us'][method]['p99']:.1f} us of processor time, wanted at most "
        f"{figures['target_us']:g}: {_verdict(robot['reached']['cost'])}",
        f"feasible for OSQP at 1e-9, not for {method}: {robot['only_osqp']} poses, wanted 0: "
        f"{_verdict(robot['reached']['feasible_wherever_osqp'])}; the other way round "
        f"{robot['only_ours']}",
    ]


def _verdict(reached: bool) -> str:
    return "reached" if reached else "MISSED"
