"""Recordings as tables for other programs: CSV or Parquet."""

from __future__ import annotations

import contextlib
import json
from pathlib import Path
from typing import IO, Any

import pyarrow as pa  # type: ignore[import-untyped]
from pyarrow import csv, parquet

from cdpr_rt.service.recordings.recording_reader import Columns
from cdpr_tools.errors import BadInputError, WorkFailedError, os_error_as
from cdpr_tools.recordings.selection import Selection

FORMATS = (".csv", ".parquet")


def check_target(path: Path, overwrite: bool) -> None:
    """Raise BadInputError where `path` cannot be written to."""
    if path.suffix not in FORMATS:
        raise BadInputError(f"--out {path}: allowed: a name that ends in {' or '.join(FORMATS)}")
    with os_error_as(BadInputError, f"--out {path}: cannot be written"):
        exists = path.exists()
    if exists and not overwrite:
        raise BadInputError(f"--out {path}: exists already; give --overwrite to write over it")


def export(selection: Selection, path: Path) -> int:
    """Write the rows to `path`, one column for each field and axis; return their number.

    Raises BadInputError where there are none, WorkFailedError where it cannot be written.
    """
    part = path.with_name(path.name + ".part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with part.open("wb") as file:
            count = _write(selection, file, path.suffix)
        part.replace(path)
        return count
    except OSError as error:
        raise WorkFailedError(f"{path}: cannot be written: {error.strerror or error}") from error
    finally:
        with contextlib.suppress(OSError):
            part.unlink(missing_ok=True)


def _write(selection: Selection, file: IO[bytes], suffix: str) -> int:
    count, writer = 0, None
    try:
        for columns in selection.rows():
            table = _table(columns)
            if writer is None and suffix == ".csv":
                writer = csv.CSVWriter(file, table.schema)
            elif writer is None:
                writer = parquet.ParquetWriter(file, table.schema, compression="zstd")
            writer.write_table(table)
            count += table.num_rows
        if writer is None:
            names = ", ".join(str(reader.path) for reader in selection.readers)
            raise BadInputError(f"{names}: no cycles in what was asked for")
        if suffix == ".parquet":
            described = json.dumps(selection.readers[-1].description)
            writer.add_key_value_metadata({"description": described})
        writer.close()
    except BaseException:
        if writer is not None:
            with contextlib.suppress(Exception):  # or it complains later, of the file being closed
                writer.close()
        raise
    return count


def _table(columns: Columns) -> Any:
    """Return flat columns, `name[0]` and so on for arrays; what is not known is null."""
    flat: dict[str, Any] = {}
    for name, values in columns.items():
        if values.ndim == 1:
            flat[name] = pa.array(values, from_pandas=True)
        else:
            for k in range(values.shape[1]):
                flat[f"{name}[{k}]"] = pa.array(values[:, k], from_pandas=True)
    return pa.table(flat)
