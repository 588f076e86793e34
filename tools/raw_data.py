"""Folders that hold the recordings of a measurement: no loss, and named when something fails."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from cdpr_drivers.errors import ConfigurationError, DriverError
from cdpr_rt.errors import ControlError, InvalidRequestError
from cdpr_tools.errors import BadInputError, WorkFailedError


def refuse_loss(folder: Path, raw: Path, overwrite: bool) -> None:
    """Raise BadInputError where earlier recordings in `raw` would be lost from --out `folder`."""
    if raw.is_dir() and any(raw.iterdir()) and not overwrite:
        raise BadInputError(
            f"--out {folder}: holds the data of an earlier run; choose another folder, or "
            "replace it with --overwrite"
        )


@contextmanager
def keeping_raw_data(raw: Path) -> Iterator[None]:
    """Add to the message of what failed where the recordings made so far are."""
    try:
        yield
    except (ConfigurationError, InvalidRequestError):
        raise
    except (ControlError, DriverError) as error:
        if not any(raw.glob("*.raw")):
            raise
        raise WorkFailedError(f"{error} (recorded so far: {raw})") from error
