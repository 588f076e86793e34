"""Commission a simulated motor and read what was identified and how much it helps.

You see the orders of the cogging torque, the friction, and the position error on a slow ramp with
and without compensation. The profile is the file that a robot's axis names as `commissioned`. It
takes a minute or two; without `quick` it takes five times as long and is more precise.
"""

import json
import sys
from pathlib import Path

import cdpr_rt as cdpr


def main(folder: str) -> None:
    """Commission the motor into a folder, then read the results."""
    if Path(folder).exists():
        sys.exit(f"{folder} exists: add the name of a new folder to the command")
    try:
        result = cdpr.commission("winch-mpp0923d", bus="simbus:", folder=folder, quick=True)
    except cdpr.Faulted as fault:  # the motor has no power; the recordings are in the folder
        sys.exit(f"the motor did not finish: {fault}")

    found = result["identification"]
    for order, amplitude_Nm in zip(found["orders"], found["amplitudes_Nm"], strict=True):
        print(f"cogging of order {order}: {1e3 * amplitude_Nm:.1f} mNm")
    forward_Nm, backward_Nm = found["coulomb_forward_Nm"], found["coulomb_backward_Nm"]
    print(f"friction: {forward_Nm:.3f} Nm forward, {backward_Nm:.3f} Nm backward")

    for method in ("none", "thesis", "harmonic"):
        error_deg = result["validation"][method]["rms_position_error_deg"]
        print(f"position error, compensation {method}: {error_deg:.3f} deg RMS")

    profile = json.loads(Path(result["files"]["profile"]).read_text(encoding="utf-8"))
    print(f"{profile['motor']} on {profile['drive']}: {len(profile['raw_data'])} recordings")
    print(f"report: {result['files']['report']}")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "commission_motor")
