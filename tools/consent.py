"""Ask before something is done that the user might regret."""

from __future__ import annotations

import typer

from cdpr_tools.errors import BadInputError


def require_consent(question: str, yes: bool, undone: str = "nothing was energised") -> None:
    """Ask on standard error, unless `yes`; raises BadInputError when nobody agrees."""
    if yes:
        return
    try:
        agreed = typer.confirm(f"{question} Go on?", err=True)
    except typer.Abort:  # nobody there to answer
        agreed = False
    if not agreed:
        raise BadInputError(f"not confirmed (--yes does it beforehand); {undone}")
