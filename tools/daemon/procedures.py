"""The procedures that a daemon's page may start: a fixed list of commands with checked values."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from cdpr_drivers.robot.commissioned import folder_of
from cdpr_profiles import Robot, load_robot
from cdpr_profiles.errors import ProfileError
from cdpr_profiles.robot import RobotAxis
from cdpr_profiles.user_folders import state_folder
from cdpr_rt.service import http_models as models
from cdpr_rt.service.procedure_runner import Procedure, ProcedureError
from cdpr_tools.daemon.settings import RunSettings
from cdpr_tools.streams import PROCEDURE_VARIABLE

_NICE: Final = ("nice", "-n10")
"""Words before a command that does not need real time, so that it does not delay the loop."""
_REPORTS: Final = (("Calibration", "calibration.html"), ("Picture", "calibration.png"))


def planned(settings: RunSettings, request: Any) -> Procedure:
    """Return what runs for a checked request to a daemon; raises ProcedureError.

    No text of the request becomes an option or a path: axes are names of the robot's file.
    """
    try:
        robot = load_robot(settings.robot)
        folder = state_folder() / "procedures" / robot.profile
        return _Plans(settings, robot, folder).of(request)
    except ProfileError as error:
        raise ProcedureError(str(error)) from None


def _command(*words: str) -> tuple[str, ...]:
    return (sys.executable, "-P", "-m", "cdpr_tools.cli", *words, "--json")


@dataclass(frozen=True)
class _Plans:
    """Makes the procedures of one daemon."""

    settings: RunSettings
    robot: Robot
    folder: Path
    """Folder of all procedures of this robot."""

    def of(self, request: Any) -> Procedure:
        """Return the procedure for a request."""
        plans: dict[type, Callable[[Any], Procedure]] = {
            models.Commission: self._commission,
            models.CalibrateTension: self._tension,
            models.MeasurePoses: self._measure,
            models.AdoptCalibration: self._adopt,
            models.CheckCalibration: self._check,
            models.UndoCalibration: self._undo,
            models.CalibrateLens: self._lens,
        }
        return plans[type(request)](request)

    def _axis(self, name: str) -> RobotAxis:
        for axis in self.robot.axes:
            if axis.name == name:
                return axis
        allowed = ", ".join(axis.name for axis in self.robot.axes)
        raise ProcedureError(f"axis {name!r}; allowed: {allowed}")

    def _procedure(
        self,
        what: str,
        *commands: tuple[str, ...],
        out: Path,
        reports: tuple[tuple[str, str], ...] = (),
        takes_bus: bool = False,
        moves: bool = False,
        real_time: bool = False,
        **values: Any,
    ) -> Procedure:
        if self.settings.simulated or not real_time:
            commands = tuple((*_NICE, *command) for command in commands)
        values |= {"folder": str(out), "robot": self.robot.reference}
        return Procedure(what, commands, PROCEDURE_VARIABLE, out, reports, takes_bus, moves, values)

    def _buses(self) -> tuple[str, ...]:
        """Return the options that select the drives.

        The drives of a simulated loop carry cables. So for a simulated robot, the options select
        motors that the command itself simulates.
        """
        settings = self.settings
        if settings.simulated:
            plant = () if settings.plant is None else (f"--plant={settings.plant}",)
            return ("--bus=simbus:", *plant)
        io = () if settings.safety_io is None else (f"--safety-io={settings.safety_io}",)
        return (*(f"--bus={url}" for url in settings.buses), *io, "--yes")

    def _commission(self, request: models.Commission) -> Procedure:
        if self.settings.read_only:
            raise ProcedureError("this daemon only listens (--read-only)")
        axes = [self._axis(name) for name in dict.fromkeys(request.axes)]
        words = [f"--axis={axis.name}" for axis in axes] + ["--quick"] * request.quick
        out = self.folder / "commission"
        command = _command(
            "commission", self.robot.reference, *words, *self._buses(), f"--out={out}",
            "--overwrite",
        )  # fmt: skip
        return self._procedure(
            f"commissioning of {', '.join(axis.name for axis in axes)}",
            command,
            out=out,
            reports=tuple((axis.name, f"{folder_of(axis)}/report.html") for axis in axes),
            takes_bus=not self.settings.simulated,
            real_time=True,
        )

    def _tension(self, request: models.CalibrateTension) -> Procedure:
        axis = self._axis(request.axis)
        masses = ",".join(f"{mass:g}" for mass in request.masses_kg)
        if not self.settings.simulated:
            raise ProcedureError(
                "somebody has to hang the masses and confirm each at a terminal: "
                f"cdpr tension calibrate {axis.winch.reference} --masses {masses} --bus URL"
            )
        out = self.folder / f"tension-{folder_of(axis)}"
        command = _command(
            "tension", "calibrate", axis.winch.reference, "--bus=simbus:", f"--masses={masses}",
            f"--out={out}", "--overwrite",
        )  # fmt: skip
        reports = (("Torque over tension", "winch-calibration.png"),)
        return self._procedure(
            f"tension calibration of {axis.name}", command, out=out, reports=reports
        )

    def _measure(self, request: models.MeasurePoses) -> Procedure:
        name = f"calibrate-{datetime.now(UTC):%Y%m%d-%H%M%S}"
        out = self.folder / name
        words = [] if request.poses is None else [f"--poses={request.poses}"]
        words += self._camera() if request.camera else []
        command = _command(
            "calibrate", "measure", f"--socket={self.settings.socket}", f"--out={out}",
            "--dry-run", *words,
        )  # fmt: skip
        return self._procedure(
            "measurement of poses", command, out=out, reports=_REPORTS, moves=True, measurement=name
        )

    def _camera(self) -> list[str]:
        if self.settings.camera is None:
            raise ProcedureError(
                "no simulated camera; start the robot with `cdpr run ROBOT --bus simbus: --camera "
                "SOCKET`"
            )
        lens = self.folder / "lens" / "lens.toml"
        markers = lens.parent / "images" / "markers.toml"
        if not lens.is_file():
            raise ProcedureError("the lens is not calibrated yet; calibrate it first")
        return [
            f"--camera=sim:{self.settings.camera}", f"--intrinsics={lens}", f"--markers={markers}"
        ]  # fmt: skip

    def _adopt(self, request: models.AdoptCalibration) -> Procedure:
        out = self.folder / request.measurement
        if not out.is_dir():
            raise ProcedureError(
                f"{request.measurement}: no such measurement of {self.robot.profile}"
            )
        words = ["--adopt"] * request.insignificant
        command = _command("calibrate", "fit", self.robot.reference, f"--data={out}", *words)
        return self._procedure("adoption of a calibration", command, out=out, reports=_REPORTS)

    def _check(self, _request: models.CheckCalibration) -> Procedure:
        out = self.folder / "check"
        command = _command(
            "calibrate", "check", self.robot.reference, "--running",
            f"--socket={self.settings.socket}", f"--out={out}",
        )  # fmt: skip
        return self._procedure("check of the calibration", command, out=out, moves=True)

    def _undo(self, _request: models.UndoCalibration) -> Procedure:
        command = _command("calibrate", "undo", self.robot.reference)
        return self._procedure("undoing of the calibration", command, out=self.folder)

    def _lens(self, request: models.CalibrateLens) -> Procedure:
        if not self.settings.simulated:
            raise ProcedureError(
                "a person must move the board in front of the camera; run: "
                "cdpr camera calibrate opencv:0 --out lens.toml"
            )
        out = self.folder / "lens"
        images = out / "images"
        plant = () if self.settings.plant is None else (f"--plant={self.settings.plant}",)
        photos = _command(
            "sim", "photos", str(images), f"--count={request.images}", "--board", "--overwrite",
            *plant,
        )  # fmt: skip
        fit = _command(
            "camera", "calibrate", str(images), f"--out={out / 'lens.toml'}", "--overwrite",
            f"--png={out / 'lens.png'}",
        )  # fmt: skip
        for old in images.glob("image-*.png"):  # of a run with more images
            old.unlink()
        reports = (("Corners and residuals", "lens.png"),)
        return self._procedure("calibration of the lens", photos, fit, out=out, reports=reports)
