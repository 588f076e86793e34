"""Ask before an action that the user might regret."""

from __future__ import annotations

import sys

import typer

from cdpr_profiles.errors import printable
from cdpr_tools.errors import BadInputError
from cdpr_tools.output import fold, width_of


def require_consent(question: str, yes: bool, undone: str = "nothing was energised") -> None:
    """Ask on standard error, unless `yes`; raises BadInputError if the user does not agree."""
    if yes:
        return
    try:
        asked = fold(f"{printable(question)} Continue?", width_of(sys.stderr))
        agreed = typer.confirm(asked, err=True)
    except typer.Abort:  # nobody can answer
        agreed = False
    if not agreed:
        raise BadInputError(f"not confirmed (--yes confirms in advance); {undone}")
