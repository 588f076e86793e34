"""Refuse a machine whose cycle cannot fit its buses, before anything is opened."""

from __future__ import annotations

from collections.abc import Sequence

from cdpr_drivers.bus.budget import BusBudget, machine_budget
from cdpr_drivers.errors import ConfigurationError
from cdpr_profiles import Robot, Winch


def refusal(budgets: Sequence[BusBudget]) -> str:
    """Return why the cycle does not fit its buses, empty when it does."""
    tight = [str(budget) for budget in budgets if not budget.fits]
    return "the cycle does not fit: " + "; ".join(tight) if tight else ""


def require_fit(machine: Winch | Robot) -> None:
    """Raise ConfigurationError with the figure when a bus of `machine` cannot carry its cycle."""
    reason = refusal(machine_budget(machine))
    if reason:
        raise ConfigurationError(
            f"{machine.path}: sync_period_s: {machine.sync_period_s:g}: {reason}; "
            "`cdpr bus budget` shows the parts"
        )
