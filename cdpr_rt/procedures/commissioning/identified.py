"""Identification of a motor from the recorded passes of a commissioning; its cogging profile."""

from __future__ import annotations

import dataclasses
from datetime import UTC, datetime
from pathlib import Path

from cdpr_profiles import Winch
from cdpr_rt.identification.cogging.harmonic_model import identify_harmonic_model
from cdpr_rt.identification.cogging.result import HarmonicResult
from cdpr_rt.identification.cogging.second_pass import MOST_ROUNDS, SecondPass
from cdpr_rt.identification.cogging.sweep import SweepData
from cdpr_rt.identification.cogging.thesis import ThesisResult, identify_thesis
from cdpr_rt.identification.cogging_profile import (
    CoggingProfile,
    DriveIdentity,
    stored_harmonic_model,
    stored_harmonics,
    stored_thesis,
)
from cdpr_rt.identification.rawlog import read_raw_log
from cdpr_rt.procedures.commissioning.commission_files import Paths
from cdpr_rt.procedures.measurement import recording


@dataclasses.dataclass(frozen=True)
class Identified:
    """Results of both methods."""

    thesis: ThesisResult
    harmonic: HarmonicResult


def legs(paths: list[Path]) -> list[SweepData]:
    """Return recorded passes as the identification takes them; raises RawLogError."""
    # nothing but the sweep stays in memory: a recording is large
    return [recording(read_raw_log(path)).sweep for path in paths]


def identify(winch: Winch, latency_s: float, paths: Paths) -> Identified:
    """Identify from the recorded passes in `paths`, all rounds of the second pass included.

    Raises RawLogError and IdentificationError.
    """
    found = identify_first(winch, latency_s, paths)
    second = SecondPass(found.harmonic, legs(paths.passes("fast")))
    for number in range(MOST_ROUNDS):
        recorded = paths.passes(round_name(number))
        if not recorded or second.done:
            break
        second.add(legs(recorded))
    return dataclasses.replace(found, harmonic=second.best)


def identify_first(winch: Winch, latency_s: float, paths: Paths) -> Identified:
    """Identify from the sweeps and the fast legs alone."""
    sweep, fast = (legs(paths.passes(name)) for name in ("sweep", "fast"))
    inertia, pole_pairs = winch.motor.rotor_inertia_kg_m2, winch.motor.poles // 2
    harmonic = identify_harmonic_model(sweep + fast, inertia, latency_s, pole_pairs)
    return Identified(identify_thesis(sweep), harmonic)


def round_name(number: int) -> str:
    """Return the name under which a round of the second pass is recorded."""
    return f"round{number}"


def store_profile(winch: Winch, identity: DriveIdentity, found: Identified, paths: Paths) -> None:
    """Write the cogging profile."""
    harmonic = found.harmonic
    names = ("sweep", "fast", *(round_name(number) for number in range(MOST_ROUNDS)))
    raw = [path.name for name in names for path in paths.passes(name)]
    CoggingProfile(
        motor=winch.motor.model,
        drive=winch.drive.name,
        identity=identity,
        created=datetime.now(UTC).replace(microsecond=0),
        raw_data=raw,
        inertia_kg_m2=harmonic.inertia_kg_m2.value,
        harmonics=stored_harmonics(harmonic),
        residual_rms_Nm=harmonic.residual_rms_Nm,
        repaired_fraction=found.thesis.repaired_fraction,
        coverage=harmonic.coverage,
        thesis=stored_thesis(found.thesis),
        better=stored_harmonic_model(harmonic),
    ).save(paths.profile)


def validation_name(method: str, bandwidth_Hz: float) -> str:
    """Return the name under which a validation run is recorded."""
    return f"validate-{bandwidth_Hz:g}Hz-{method}"
