"""`cdpr bench`: what the project costs, measured on this machine."""

from __future__ import annotations

import typer

from cdpr_tools.command_group import group_of

MODULES = {
    "bench.cyclic.bench_bus": {
        "bus": "Measure frames per second and host cost per frame, beside plain python-can.",
    },
    "bench.bench_calibration": {
        "calibration": "Measure the identification of spatial-8: poses measured, unknown, and "
        "by plain SciPy.",
    },
    "bench.platforms.bench_control": {
        "control": "Measure one update of a platform's control: pose, wrench, tensions, torques.",
    },
    "bench.cyclic.bench_cycle": {
        "cycle": "Measure one exchange with 8 axes: ours, the canopen package's PDO path, and "
        "the floor.",
        "profiles": "Measure loading and validating every shipped profile, against bare TOML "
        "parsing.",
    },
    "bench.platforms.bench_kinematics": {
        "kinematics": "Measure the pose from cable lengths: along a path, and from bad starts.",
    },
    "bench.cyclic.bench_latency": {
        "latency": "Measure how late a loop wakes up, with and without the real-time settings, "
        "as a picture.",
    },
    "bench.cyclic.bench_loop": {
        "loop": "Measure the control loop of 8 axes on two simulated buses at 1 kHz, and one "
        "full bus.",
    },
    "bench.bench_markers": {
        "markers": "Make a map of 42 markers from rendered images, beside one from OpenCV's "
        "own corners.",
    },
    "bench.platforms.bench_path": {
        "path": "Measure planning a G-code file as CAM writes it, for spatial-8: preview and "
        "picture too.",
    },
    "bench.platforms.bench_poses": {
        "poses": "Measure drawing reachable poses of spatial-8, and look at ways again by "
        "plain NumPy.",
    },
    "bench.cyclic.bench_soak": {
        "soak": "Move a simulated robot in lockstep for hours; no memory may leak and no frame "
        "be lost.",
    },
    "bench.cyclic.bench_stop": {
        "stop": "Measure how soon the loop accepts a stop while four clients flood every "
        "interface.",
    },
    "bench.platforms.bench_tension": {
        "tension": "Measure tension distribution on poses of spatial-8 and suspended-8, "
        "feasible or not.",
    },
    "bench.platforms.bench_workspace": {
        "workspace": "Measure whether the cables of spatial-8 hold poses, at full "
        "acceleration, on one core.",
    },
}

app = typer.Typer(
    name="bench",
    cls=group_of(MODULES),
    help="Measure this project's own cost on this machine.",
    no_args_is_help=True,
)


@app.callback()
def _group() -> None:
    """Measure this project's own cost on this machine."""
