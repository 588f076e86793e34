"""The files of a commissioning."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Paths:
    """Files of a commissioning."""

    out: Path

    @property
    def raw_folder(self) -> Path:
        """Return where the recorded passes are."""
        return self.out / "raw"

    def raw(self, name: str) -> Path:
        """Return the file of one recorded pass."""
        return self.raw_folder / f"{name}.raw"

    def passes(self, name: str) -> list[Path]:
        """Return the recorded passes whose names begin with `name`, in the order they were run."""
        found = self.raw_folder.glob(f"{name}-[0-9]*.raw")
        return sorted(found, key=lambda path: int(path.stem.rsplit("-", 1)[1]))

    @property
    def profile(self) -> Path:
        """Return the file of the cogging profile."""
        return self.out / "cogging-profile.json"

    @property
    def run(self) -> Path:
        """Return the file of what the report must know besides the recordings."""
        return self.out / "run.json"

    @property
    def results(self) -> Path:
        """Return the file of the results."""
        return self.out / "report.json"

    @property
    def page(self) -> Path:
        """Return the report for people."""
        return self.out / "report.html"

    @property
    def truth(self) -> Path:
        """Return the simulator's own log, which only the report reads."""
        return self.out / "simulator-truth.log"
