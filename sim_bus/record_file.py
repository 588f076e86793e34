"""A file of records that begins by describing them: what was true, or measured from outside."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

HEADER_BYTES = 1024
NO_SYNC = 0xFFFFFFFF
"""In place of the SYNC's number in a record that belongs to none."""


class RecordFile:
    """One line of JSON, padded with spaces to HEADER_BYTES, newline included; then records.

    A file that cannot be written on ends, and says so; whoever writes goes on.
    """

    def __init__(self, path: Path, header: Mapping[str, Any]) -> None:
        """Create the file; raises OSError."""
        self._file = path.open("wb", buffering=0)
        self.write(json.dumps(header).encode().ljust(HEADER_BYTES - 1) + b"\n")

    def write(self, data: bytes | memoryview) -> None:
        """Append records."""
        if self._file.closed:
            return
        try:
            while data:
                data = data[self._file.write(data) :]
        except OSError as error:
            print(f"log {self._file.name}: {error.strerror}; it ends here", file=sys.stderr)
            self._file.close()

    def close(self) -> None:
        """Close the file."""
        self._file.close()
