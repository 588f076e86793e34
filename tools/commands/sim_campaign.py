"""`cdpr sim campaign`: play random scenarios on simulated robots and judge what the robots do."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated

import typer

from cdpr_tools.commands.options import ClusterOption, JsonOption, argument, option
from cdpr_tools.errors import BadInputError, WorkFailedError
from cdpr_tools.output import Output

if TYPE_CHECKING:
    from cdpr_tools.campaign.judge import Result
    from cdpr_tools.campaign.scenario import Scenario

app = typer.Typer()
_EXPECTED_S = 4.0


@app.command()
def campaign(
    robots: Annotated[
        list[str] | None, argument("Robots with a platform.", metavar="ROBOT...")
    ] = None,
    seeds: Annotated[int, option("Number of seeds.", min=1)] = 60,
    first: Annotated[int, option("First seed.", "--from", min=0)] = 0,
    workers: Annotated[
        int | None, option("Number of processes; default: one for each core.", min=1, max=256)
    ] = None,
    cluster: ClusterOption = None,
    replay: Annotated[
        int | None, option("Repeat one seed with a recording.", min=0, metavar="SEED")
    ] = None,
    shrink: Annotated[
        int | None,
        option("Print the smallest script that fails in the same way.", min=0, metavar="SEED"),
    ] = None,
    script: Annotated[
        Path | None, option("Play this script instead of seeds.", metavar="FILE")
    ] = None,
    target: Annotated[
        Path | None, option("Folder for the recording and the picture.", "--out", metavar="DIR")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Play random user actions and faults on simulated robots, and judge how the robots react.

    A seed determines its scenario. The exit status is 1 if an invariant was violated.
    """
    # imported here: it loads the loop and the simulator
    from cdpr_tools.campaign import campaign as plays  # noqa: PLC0415
    from cdpr_tools.campaign.scenario import Scenario  # noqa: PLC0415

    out = Output(as_json)
    if script is None and not robots:
        raise BadInputError("ROBOT...: name at least one robot, or give --script FILE")
    one = replay if replay is not None else shrink
    numbers = range(first, first + seeds) if one is None else (one,)
    chosen = [Scenario.load(script)] if script is not None else plays.drawn(numbers, robots or ())
    if shrink is not None:
        out.say(plays.shrunk(chosen[0], out.note).text())
        return
    if replay is not None:
        results = [_recorded(chosen[0], target or Path(f"seed-{replay}"), out)]
    else:
        expected_s = _EXPECTED_S * len(chosen)
        with out.progress("seeds", expected_s) as advance:
            results = plays.run(chosen, workers, cluster, lambda part: advance(expected_s * part))
    failing = [result for result in results if result.violations]
    out.say(*plays.table(results))
    for result in failing:
        out.say(f"seed {result.seed}, {result.robot}:", *(f"  {v}" for v in result.violations))
    out.say(*plays.summary(results))
    out.result({"ok": not failing, "results": [vars(result) for result in results]})
    if failing:
        raise typer.Exit(WorkFailedError.exit_status)


def _recorded(scenario: Scenario, folder: Path, out: Output) -> Result:
    from cdpr_tools.campaign.farm import run_alone  # noqa: PLC0415
    from cdpr_tools.recordings.picture import FIELDS, draw  # noqa: PLC0415
    from cdpr_tools.recordings.selection import Selection  # noqa: PLC0415

    folder.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(prefix="cdpr-campaign-") as passing, out.stage("playing"):
        result = run_alone(replace(scenario, recorded=False), Path(passing), folder)
    selection = Selection(sorted(folder.glob("*.mcap")), FIELDS)
    draw(selection, selection.columns(), None, folder / "seed.png")
    (folder / "script.json").write_text(scenario.text(), encoding="utf-8")
    out.say(*map(str, sorted(folder.iterdir())))
    return result
