"""Report that kernels are compiled, which takes minutes if the installation did not do it."""

from __future__ import annotations

import logging
import sys

from typing_extensions import override

NOTICE = "compiling"
"""Start of the notice; a command that hides its simulator's output forwards it."""
_LOG = logging.getLogger("cdpr.compiling")


class _Notice(logging.Handler):
    """Reports the first kernel that this process compiles, on standard error."""

    def __init__(self, what: str) -> None:
        super().__init__()
        self._what = what

    @override
    def emit(self, record: logging.LogRecord) -> None:
        text = f"{NOTICE} {self._what} once for this machine; this may take minutes ..."
        print(text, file=sys.stderr, flush=True)
        _LOG.handlers.remove(self)


def announce_compiling(what: str = "the numerics") -> None:
    """Report from now on if kernels must be compiled; `what` names the kernels in the message."""
    _LOG.handlers[:] = [_Notice(what)]
    _LOG.propagate = False
    _LOG.setLevel(logging.INFO)
