"""`cdpr import`: recordings of other programs for the commands of this project."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cdpr_profiles import Winch, load_robot, load_winch, load_winch_or_robot
from cdpr_profiles.robot import robot_of_winch
from cdpr_tools.commands import options
from cdpr_tools.commands.options import argument, option
from cdpr_tools.commission.run import prepare
from cdpr_tools.errors import BadInputError, os_error_as
from cdpr_tools.output import Output, TableText
from cdpr_tools.saving import require_free

app = typer.Typer(
    name="import",
    help="Convert recordings of other programs: CSV, OptiTrack, Vicon, candump, MCAP.",
    no_args_is_help=True,
)


@app.callback()
def _group() -> None:
    """Convert recordings of other programs: CSV, OptiTrack, Vicon, candump, MCAP."""


FilesArgument = Annotated[list[Path], argument("CSV, candump or MCAP files.", metavar="FILE...")]
MapOption = Annotated[
    Path, option("TOML file that states what each column contains.", "--map", metavar="FILE")
]
PosesOption = Annotated[
    Path | None,
    option("File with the poses, if they are not in the first one.", "--poses", metavar="FILE"),
]


@app.command()
def motor(
    winch: options.WinchArgument,
    files: FilesArgument,
    mapping: MapOption,
    out_dir: Annotated[
        Path, option("Folder for the converted passes of the motor.", "--out", metavar="DIR")
    ],
    overwrite: options.OverwriteOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """Convert recordings of a turning motor for `cdpr cogging fit` and `cdpr cogging compare`.

    Each motion in one direction becomes a pass. Columns: time, angle, torque (or current).
    """
    from cdpr_tools.imports.motor import import_motor  # noqa: PLC0415  # slow to load

    out = Output(as_json)
    found = import_motor(files, mapping, load_winch(winch), prepare(out_dir, overwrite))
    for note in found.notes:
        out.note(note)
    head = ["pass", "from", "turns", "speed", "samples", "in gaps"]
    rows = [
        [
            one["pass"], one["source"], f"{one['turns']:.2f}", f"{one['speed_deg_s']:.1f} deg/s",
            str(one["samples"]), f"{one['in_gaps']:.1%}",
        ]
        if "turns" in one
        else [one["pass"], one["source"], "", "", str(one["samples"]), ""]
        for one in found.passes
    ]  # fmt: skip
    out.say(f"written to {out_dir / 'raw'}", TableText([head, *rows], left=["pass", "from"]))
    out.result(
        {
            "ok": True,
            "passes": found.passes,
            "torque_lag_s": found.torque_lag_s,
            "notes": found.notes,
        }
    )


@app.command()
def calibration(
    robot: options.RobotArgument,
    cables: Annotated[Path, argument("File with the cable lengths.", metavar="FILE")],
    mapping: MapOption,
    out_dir: Annotated[Path, option("Folder for data.json.", "--out", metavar="DIR")],
    poses: PosesOption = None,
    overwrite: options.OverwriteOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """Convert cable lengths and measured poses for `cdpr calibrate fit ROBOT --data DIR`.

    The platform must be at home in the first row that is used. Tensions and rotations may be
    missing.
    """
    from cdpr_tools.imports.calibration import import_calibration  # noqa: PLC0415  # slow to load

    out = Output(as_json)
    path = out_dir / "data.json"
    if path.exists() and not overwrite:
        raise BadInputError(f"{path}: already exists; replace it with --overwrite")
    profile = load_robot(robot)
    data, notes = import_calibration(cables, poses or cables, mapping, profile)
    for note in notes:
        out.note(note)
    with os_error_as(BadInputError, f"--out {out_dir}: cannot be written"):
        out_dir.mkdir(parents=True, exist_ok=True)
    data.save(path)
    out.say(f"written: {path}, {len(data.poses)} poses")
    out.result({"ok": True, "data": str(path), "poses": len(data.poses), "notes": notes})


@app.command()
def log(
    machine: options.RobotOrWinchArgument,
    file: Annotated[Path, argument("CSV, candump or MCAP file.", metavar="FILE")],
    mapping: MapOption,
    target: Annotated[Path, option("Recording to write; a name ending in .mcap.", "--out")],
    poses: PosesOption = None,
    overwrite: options.OverwriteOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """Convert a recording for `cdpr log info`, `cdpr log plot` and `cdpr log export`.

    It may hold angles, speeds, torques, lengths, tensions and poses. Missing quantities stay empty.
    """
    from cdpr_tools.imports.recording import import_recording, write_recording  # noqa: PLC0415  # slow to load

    out = Output(as_json)
    if target.suffix != ".mcap":
        raise BadInputError(f"--out {target}: allowed: a name that ends in .mcap")
    require_free("--out", target, overwrite)
    profile = load_winch_or_robot(machine)
    robot = robot_of_winch(profile) if isinstance(profile, Winch) else profile
    imported, known = import_recording(file, poses or file, mapping, robot)
    write_recording(imported, robot, target)
    count, last_s = imported.rows.size, float(imported.rows["time_s"][-1])
    out.say(f"written: {target}, {count} rows in {last_s:.2f} s with {', '.join(known) or 'time'}")
    out.result({"ok": True, "out": target, "rows": count, "seconds": last_s, "fields": known})
