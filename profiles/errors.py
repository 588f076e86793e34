"""The one error of this package."""

from pathlib import Path


class ProfileError(Exception):
    """A profile cannot be used; the text names the file, the key, the value and what is allowed.

    `file` and `key` (dotted, "" for the file as a whole) are also there for programs.
    """

    def __init__(self, file: Path | str, key: str, problem: str) -> None:
        self.file = str(file)
        self.key = key
        self.problem = problem
        where = f"{self.file}: {key}" if key else self.file
        super().__init__(f"{where}: {problem}")
