"""True and scanned poses of a simulated robot; they verify a calibration and are not in it."""

from __future__ import annotations

from pathlib import Path

from pydantic import Field

from cdpr_profiles.calibration.geometry import write_text
from cdpr_profiles.reading.reader import Profile, read_json_model

_Vector = tuple[float, ...]
_Matrix = tuple[_Vector, ...]


class OutsidePose(Profile):
    """A pose as the simulator has it, and as its scanner measures it where it does."""

    true_position_m: _Vector
    true_rotation: _Matrix
    position_m: _Vector | None = None
    position_std_m: float | None = None
    """Of each coordinate."""
    rotation: _Matrix | None = None
    rotation_std_rad: float | None = None
    """About each axis."""

    def with_truth_of(self, other: OutsidePose) -> OutsidePose:
        """Return this with what was true at another time."""
        of_other = ("true_position_m", "true_rotation")
        return self.model_copy(update={name: getattr(other, name) for name in of_other})


class OutsidePoses(Profile):
    """Of all poses of a calibration's data, in their order."""

    poses: tuple[OutsidePose, ...] = Field(max_length=100_000)

    def save(self, path: Path) -> None:
        """Write the file; raises ProfileError."""
        write_text(path, self.model_dump_json() + "\n")

    @classmethod
    def load_file(cls, path: str | Path) -> OutsidePoses:
        """Read such a file; raises ProfileError."""
        return read_json_model(Path(path), cls)
