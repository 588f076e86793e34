"""Ask before an action that the user might regret."""

from __future__ import annotations

import typer

from cdpr_profiles.errors import printable
from cdpr_tools.errors import BadInputError


def require_consent(question: str, yes: bool, undone: str = "nothing was energised") -> None:
    """Ask on standard error, unless `yes`; raises BadInputError if the user does not agree."""
    if yes:
        return
    try:
        agreed = typer.confirm(f"{printable(question)} Go on?", err=True)
    except typer.Abort:  # nobody can answer
        agreed = False
    if not agreed:
        raise BadInputError(f"not confirmed (--yes does it beforehand); {undone}")
