"""Cogging, friction and inertia of a motor from recorded runs, by two methods."""

from cdpr_rt.identification.cogging.harmonic_model import identify_harmonic_model, refine
from cdpr_rt.identification.cogging.result import Harmonic, HarmonicResult
from cdpr_rt.identification.cogging.second_pass import MOST_ROUNDS, SecondPass
from cdpr_rt.identification.cogging.sweep import IdentificationError, SweepData
from cdpr_rt.identification.cogging.thesis import ThesisResult, identify_thesis
from cdpr_rt.identification.confidence import ConfidenceInterval

__all__ = [
    "MOST_ROUNDS",
    "ConfidenceInterval",
    "Harmonic",
    "HarmonicResult",
    "IdentificationError",
    "SecondPass",
    "SweepData",
    "ThesisResult",
    "identify_harmonic_model",
    "identify_thesis",
    "refine",
]
