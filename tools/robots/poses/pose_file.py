"""A list of poses as a file: CSV, or TOML as `cdpr path` reads it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from cdpr_rt.core.exchange import FloatArray
from cdpr_tools.errors import BadInputError

KINDS = (".csv", ".toml")


def checked_file(path: Path) -> Path:
    """Return a path that can be written as a list of poses; raises BadInputError."""
    if path.suffix not in KINDS or not path.parent.is_dir():
        raise BadInputError(f"{path}: allowed: NAME.csv or NAME.toml in a folder that is there")
    return path


def write_poses(path: Path, positions: FloatArray, names: Sequence[str], lengths: int) -> None:
    """Write positions (m, d), of whose directions, called `names`, the first are `lengths`.

    Raises BadInputError where it cannot be written.
    """
    if path.suffix == ".csv":
        units = ["m"] * lengths + ["rad"] * (len(names) - lengths)
        lines = [",".join(f"{name}_{unit}" for name, unit in zip(names, units, strict=True))]
        lines += [",".join(f"{x:.6f}" for x in position) for position in positions]
    else:
        lines = []
        for position in positions:
            lines += ["[[points]]", f"position_m = [{_listed(position[:lengths])}]"]
            if len(position) > lengths:
                lines.append(f"rotation_rad = [{_listed(position[lengths:])}]")
            lines.append("")
    try:
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    except OSError as error:
        raise BadInputError(f"{path}: {error.strerror}") from None


def _listed(values: FloatArray) -> str:
    return ", ".join(f"{x:.6f}" for x in values)
