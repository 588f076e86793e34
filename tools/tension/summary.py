"""What a winch's calibration tells on the terminal."""

from __future__ import annotations

from pathlib import Path

from cdpr_profiles.winch_calibration import WinchCalibration
from cdpr_tools.output import Output


def show(out: Output, found: WinchCalibration, path: Path) -> None:
    """Say what was found."""
    gain, half = found.gain_m * 1e3, found.gain_half_width_m * 1e3
    apart = 100.0 * (found.gain_m / found.nominal_gain_m - 1.0)
    out.say(f"gain K_t         {gain:.3f} ± {half:.3f} mNm/N ({apart:+.1f} % from the geometry)")
    out.say(
        f"friction         {found.friction_Nm:.3f} ± {found.friction_half_width_Nm:.3f} Nm, and "
        f"{found.friction_per_N_m * 1e3:.2f} ± {found.friction_per_N_half_width_m * 1e3:.2f} mNm/N"
    )
    top = found.highest_tension_N
    share = 100.0 * found.friction_at_Nm(top) / found.torque_Nm(top)
    out.say(f"                 {share:.1f} % of the torque at {top:.0f} N")
    out.say(f"bias             {found.bias_Nm:+.3f} ± {found.bias_half_width_Nm:.3f} Nm")
    out.say(f"residual         {found.residual_rms_Nm * 1e3:.1f} mNm rms")
    out.say(f"calibration      {path}")
