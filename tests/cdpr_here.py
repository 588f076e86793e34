"""Run commands in the test's process, which has already loaded their libraries."""

from __future__ import annotations

import io
import subprocess
import sys
from contextlib import chdir, redirect_stderr, redirect_stdout
from pathlib import Path
from typing import TextIO
from unittest import mock

import pytest

from cdpr_tools.cli import main


def cdpr_here(
    *arguments: str | Path, stdin: str | TextIO = "", cwd: Path | None = None
) -> subprocess.CompletedProcess[str]:
    """Run a command line in this process, which saves the second that a new process needs.

    Not for commands that run control cycles: they change the scheduling of their process.
    """
    typed = io.StringIO(stdin) if isinstance(stdin, str) else stdin
    argv = ["cdpr", *map(str, arguments)]
    out, errors = io.StringIO(), io.StringIO()
    with (
        mock.patch.multiple(sys, argv=argv, stdin=typed),
        chdir(cwd or Path.cwd()),
        redirect_stdout(out),
        redirect_stderr(errors),
        pytest.raises(SystemExit) as ended,
    ):
        main()
    assert isinstance(ended.value.code, int)
    return subprocess.CompletedProcess(argv, ended.value.code, out.getvalue(), errors.getvalue())
