"""Folders for the recordings of a measurement: never lost, and named in error messages."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from cdpr_drivers.errors import ConfigurationError, DriverError
from cdpr_profiles.bounded_input import may_replace
from cdpr_rt.errors import ControlError, InvalidRequestError
from cdpr_rt.identification.rawlog import RAW_LOG
from cdpr_tools.errors import BadInputError, WorkFailedError


def refuse_loss(folder: Path, raw: Path, overwrite: bool) -> None:
    """Raise BadInputError if a run with --out `folder` would lose earlier recordings in `raw`."""
    if raw.is_dir() and any(raw.iterdir()) and not overwrite:
        raise BadInputError(
            f"--out {folder}: contains the data of an earlier run; choose another folder, "
            "or replace it with --overwrite"
        )


def discard_raw_data(raw: Path) -> bool:
    """Remove the recordings of an earlier run from `raw`; return whether there were any.

    Other files in the folder stay. Raises OSError.
    """
    ours = [path for path in raw.glob("*.raw") if path.is_file() and may_replace(path, RAW_LOG)]
    for path in ours:
        path.unlink()
    return bool(ours)


@contextmanager
def keeping_raw_data(raw: Path) -> Iterator[None]:
    """Add the place of the recordings made so far to the message of a failure."""
    try:
        yield
    except (ConfigurationError, InvalidRequestError):
        raise
    except (ControlError, DriverError) as error:
        if not any(raw.glob("*.raw")):
            raise
        raise WorkFailedError(f"{error} (recorded so far: {raw})") from error
