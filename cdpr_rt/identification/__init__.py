"""Cogging, friction and inertia of a motor from recorded runs, by two methods."""

from cdpr_rt.identification.better import identify_better, refine
from cdpr_rt.identification.result import BetterResult, Estimate, Harmonic
from cdpr_rt.identification.second_pass import MOST_ROUNDS, SecondPass
from cdpr_rt.identification.sweep import IdentificationError, SweepData
from cdpr_rt.identification.thesis import ThesisResult, identify_thesis

__all__ = [
    "MOST_ROUNDS",
    "BetterResult",
    "Estimate",
    "Harmonic",
    "IdentificationError",
    "SecondPass",
    "SweepData",
    "ThesisResult",
    "identify_better",
    "identify_thesis",
    "refine",
]
