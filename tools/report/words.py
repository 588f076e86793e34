"""What the report says in sentences, from the figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from cdpr_rt.identification.cogging.result import HarmonicResult
from cdpr_rt.identification.cogging.thesis import ThesisResult
from cdpr_tools.report.curves import (
    Ramp,
    ResidualEffort,
    TableError,
    filter_gain,
    strongest_order,
    table_errors,
)
from cdpr_tools.report.text import number, plain

_NEAR_FLOOR = 2.0
_SEEN = 0.005
_FLAT = 0.98


@dataclass(frozen=True)
class Quantity:
    """One of the three figures of the validation."""

    ratio: str
    """Its key among the ratios."""
    unit: str
    key: str
    name: str


QUANTITIES = (
    Quantity("rms_position_error", "deg", "rms_position_error_deg", "RMS position error"),
    Quantity("peak_pid_effort", "Nm", "peak_pid_effort_Nm", "peak PID effort"),
    Quantity("peak_velocity_error", "deg/s", "peak_velocity_error_deg_s", "peak velocity error"),
)
NAMES = {"none": "Without", "thesis": "Thesis’ method", "better": "Harmonic model"}


def joined(parts: Sequence[str]) -> str:
    """Return a list in words."""
    return " and ".join([", ".join(parts[:-1]), parts[-1]] if len(parts) > 1 else parts)


def lag_text(degrees: float) -> str:
    """Say by how much something comes late or early."""
    return f"{number(abs(degrees), 2)} deg {'late' if degrees >= 0.0 else 'early'}"


def missed_targets(validation: Mapping[str, Any], method: str) -> list[Quantity]:
    """Return the figures in which a method does not reach its targets."""
    goals, got = validation["targets"][method], validation[method]["ratios"]
    return [q for q in QUANTITIES if got[q.ratio] is not None and got[q.ratio] < goals[q.ratio]]


def verdict(validation: Mapping[str, Any], method: str) -> str:
    """Say what a method achieves, and whether that was asked."""
    goals, got = validation["targets"][method], validation[method]["ratios"]
    gains = joined([f"the {q.name} {number(got[q.ratio])} times" for q in QUANTITIES])
    asked = joined([plain(goals[q.ratio]) for q in QUANTITIES])
    short = missed_targets(validation, method)
    if not short:
        end = "all reached"
    elif len(short) == len(QUANTITIES):
        end = "none reached"
    else:
        end = f"not reached in the {joined([q.name for q in short])}"
    return f" makes {gains} smaller; {asked} were asked: {end}."


def judged_on(validation: Mapping[str, Any], passes: int) -> str:
    """Say what the figures are measured with."""
    which = "is the worse of the two directions" if passes > 1 else "is of increasing angle"
    how = (
        f"Each figure {which}, over one motor turn at 22 deg/s; the velocity goes through a 50 Hz "
        "low-pass, and the effort is taken about its mean."
    )
    if validation["judged_on"] == "true angle":
        return (
            "Judged on the rotor’s true angle, from the simulator’s own log, which nothing but "
            "this report has read; figures on the encoder, as a real motor has them, follow below. "
            + how
        )
    return f"Judged on the encoder, since no true angle is known of a real motor. {how}"


def floor_words(validation: Mapping[str, Any], encoder_deg: float, torque_Nm: float) -> list[str]:
    """Say how far above the floor the harmonic model is, and what sets the floor."""
    floor, harmonic = validation["floor"], validation["better"]
    above = {q.name: harmonic[q.key] / floor[q.key] for q in QUANTITIES if floor[q.key] > 0.0}
    times = joined([f"{number(ratio, 2)} in the {name}" for name, ratio in above.items()])
    words = [
        f"The floor is what the encoder’s steps of {number(encoder_deg)} deg and the drive’s "
        f"torque steps of {plain(torque_Nm * 1e3)} mNm leave in this loop by calculation, without "
        "any cogging or friction. The harmonic model comes down to this many times the floor: "
        f"{times}."
    ]
    without = validation["none"]
    most = {q.name: without[q.key] / floor[q.key] for q in QUANTITIES if floor[q.key] > 0.0}
    gains = joined([f"{number(ratio, 2)} in the {name}" for name, ratio in most.items()])
    words.append(f"With nothing but the floor left, the gains in this loop would be {gains}.")
    short = missed_targets(validation, "better")
    if short:
        names = joined([q.name for q in short])
        words.append(f"The harmonic model does not reach what was asked in the {names}.")
    close = [name for name, ratio in above.items() if ratio <= _NEAR_FLOOR]
    if close:
        words.append(
            f"In the {joined(close)} the steps of encoder and drive are therefore most of what is "
            "left: a better model would gain little."
        )
    if len(close) < len(above):
        words.append(
            "What lies above the floor is friction that differs from its model, and the cogging "
            "that was not found; the section on what is left tells what of it repeats."
        )
    return words


def standstill_words(ramps: Mapping[str, Ramp]) -> str:
    """Say how long the rotor stood still in each run."""
    shares = {method: ramp.standing for method, ramp in ramps.items()}
    if max(shares.values()) < _SEEN:
        return "The rotor never stood still on this ramp, so stick-slip sets no floor here."
    where = {
        "none": "without compensation",
        "thesis": "with the thesis’ table",
        "better": "with the harmonic model",
    }
    stretches = [f"{_percent(share)} of the time {where[m]}" for m, share in shares.items()]
    end = (
        "What the harmonic model leaves contains stick-slip, which is part of its floor."
        if shares["better"] >= _SEEN
        else "With the harmonic model stick-slip sets no floor."
    )
    return (
        f"The rotor stuck and slipped: it stood still (slower than a tenth of the ramp) "
        f"{joined(stretches)}. {end}"
    )


def _percent(share: float) -> str:
    return f"{number(100.0 * share, 2)} %" if share >= _SEEN else "0 %"


def loop_words(design: Mapping[str, Any]) -> str:
    """Say which PID was used and by which margins it was tuned."""
    gains = design["gains"]
    return (
        "All three runs have one and the same PID, tuned by margins on the uncompensated motor "
        f"(inertia {number(1e6 * design['inertia_kg_m2'])} kg mm², and by the drive’s profile "
        f"{number(1e3 * design['latency_s'])} ms from an angle to the middle of the cycle in which "
        "its torque acts): closed-loop bandwidth (−3 dB) "
        f"{number(design['bandwidth_Hz'])} Hz, crossover {number(design['crossover_Hz'])} Hz, "
        f"phase margin {number(design['phase_margin_deg'])} deg, gain margin "
        f"{number(design['gain_margin_dB'])} dB, peak of the sensitivity "
        f"{number(design['sensitivity_peak'])}. Its gains: proportional "
        f"{number(gains['proportional_Nm_rad'])} Nm/rad, integral "
        f"{number(gains['integral_Nm_rad_s'])} Nm/(rad s), derivative "
        f"{number(gains['derivative_Nms_rad'])} Nm s/rad behind a filter of "
        f"{number(1e3 * gains['derivative_filter_s'])} ms."
    )


def next_words(results: Mapping[str, Any]) -> list[str]:
    """Say what this commissioning is for, and what to do where it fell short."""
    folder, winch = results["files"]["report"].rpartition("/")[0] or ".", results["winch"]
    words = [
        f"To run the motor compensated: cdpr run {winch} --commissioned {folder}, or "
        "`commissioned` under [[axes]] in the file of its robot. Its loops are tuned by the same "
        "margins.",
        "Commission it again after a change of motor, drive or encoder, and when the error grows: "
        "friction ages, cogging does not.",
    ]
    if missed_targets(results["validation"], "better"):
        words.append(
            "A target was missed. See above whether the floor of encoder and torque steps is near: "
            "then nothing is to be gained. Otherwise commission without --quick, with the motor "
            "warm and nothing on its shaft."
        )
    return words


def method_words(
    validation: Mapping[str, Any],
    thesis: ThesisResult,
    harmonic: HarmonicResult,
    ramps: Mapping[str, Ramp],
) -> list[str]:
    """Say in figures how the thesis' curves differ from the model and what that costs."""
    short = missed_targets(validation, "thesis")
    words = []
    if short:
        got, goals = validation["thesis"]["ratios"], validation["targets"]["thesis"]
        shortfalls = [
            f"{q.name} {number(got[q.ratio])} times smaller instead of {plain(goals[q.ratio])}"
            for q in short
        ]
        words.append(f"The thesis’ method falls short here: {joined(shortfalls)}. The reasons:")
    errors = table_errors(thesis, harmonic)
    words.append(
        f"Its curves differ from the harmonic model {_error(errors[0])} for increasing and "
        f"{_error(errors[1])} for decreasing angle, where the cogging itself reaches "
        f"{number(1e3 * float(abs(harmonic.tables(3600)).max()))} mNm."
    )
    words.append(
        _cost(validation, harmonic, max(one.peak_Nm for one in errors), ramps["thesis"].standing)
    )
    if harmonic.harmonics:
        order = strongest_order(harmonic)
        words.append(
            f"In the strongest order, {order}, they have {number(errors[0].gain)} and "
            f"{number(errors[1].gain)} of the model’s amplitude and come "
            f"{lag_text(errors[0].behind_deg)} and {lag_text(errors[1].behind_deg)} in the "
            "sense of the motion."
        )
    return words + _method_limits(thesis, harmonic)


def _cost(
    validation: Mapping[str, Any], harmonic: HarmonicResult, table_error_Nm: float, standing: float
) -> str:
    """Say what the PID has to do for the table's error."""
    effort = validation["thesis"]["peak_pid_effort_Nm"]
    words = (
        "The PID has to make up for the difference: with the thesis’ table its peak effort is "
        f"{number(1e3 * effort)} mNm, {number(effort / table_error_Nm, 2)} times the largest "
        "difference."
    )
    if standing < _SEEN:
        return words
    f = harmonic.friction
    rise = max(f.stribeck_forward_Nm, f.stribeck_backward_Nm)
    higher = (
        f", which the model finds up to {number(1e3 * rise)} mNm higher at standstill than at speed"
        if rise > 0.0
        else ""
    )
    return (
        f"{words} The rotor also sticks and slips on that table: whenever it stops, the PID must "
        f"build up torque until friction{higher}, gives way, and the peak velocity error is the "
        "speed at which it then slips."
    )


def _method_limits(thesis: ThesisResult, harmonic: HarmonicResult) -> list[str]:
    """Say what in the thesis' method makes its curves differ."""
    words = []
    if thesis.repaired_fraction > 0.0:
        words.append(
            f"{number(100.0 * thesis.repaired_fraction, 2)} % of the two curves are repaired: "
            "there the rotor ran away from the ramp and the other direction’s curve stands in, "
            "which is not the same curve."
        )
    flattened = [(h.order, filter_gain(h.order)) for h in harmonic.harmonics]
    flattened = [(order, gain) for order, gain in flattened if gain < _FLAT]
    if flattened:
        shares = joined(
            [f"{number(100 * gain, 2)} % of order {order}" for order, gain in flattened]
        )
        words.append(f"Its filter over 5 deg leaves {shares}.")
    words.append(
        "Its curves also hold what the slow sweep adds to the cogging: the jumps of a rotor that "
        "sticks and slips, and one constant for the friction at that speed. That friction depends "
        "on speed, and that the rotor moves on until the torque acts, is not in them."
    )
    return words


def _error(error: TableError) -> str:
    return (
        f"by at most {number(1e3 * error.peak_Nm)} mNm (at {error.peak_deg:.0f} deg; rms "
        f"{number(1e3 * error.rms_Nm)} mNm)"
    )


def residual_words(left: ResidualEffort, residual_rms_Nm: float) -> list[str]:
    """Describe the residual, and which part of it repeats."""
    order = int(left.amplitudes_Nm.max(axis=0).argmax())
    largest = float(left.amplitudes_Nm[:, order].max())
    words = (
        "What the harmonic model could not explain is what the PID still has to do on the ramp: "
        f"{number(1e3 * left.rms_Nm)} mNm rms over the angle, of which order {order + 1} with "
        f"{number(1e3 * largest, 2)} mNm is the largest part."
    )
    if left.repeating_rms_Nm is not None:
        words += (
            f" {number(1e3 * left.repeating_rms_Nm, 2)} mNm rms come back at the same angle in the "
            "next turn and could still be learnt; the rest changes from turn to turn."
        )
    return [
        words,
        f"In the identification itself the fit leaves {number(1e3 * residual_rms_Nm)} mNm rms of "
        "torque unexplained, as averaged over its short windows.",
    ]
