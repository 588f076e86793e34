"""What is assumed of the operator, each number with where it comes from (docs/experiment.md)."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class OperatorParameters:
    """A practised operator with a stylus and a picture. SI units; hand noise is of each direction.

    Sources are named in short; docs/experiment.md has them in full.
    """

    reaction_s: float = 0.24
    """From what is seen to the begin of a movement (Card, Moran & Newell 1983: 240 ms)."""
    press_s: float = 0.10
    """From the decision to press a button until it closes (the same: 70 ms, and its travel)."""
    shortest_move_s: float = 0.25
    """Of a corrective movement (Meyer et al. 1988; Burdet & Milner 1998: 0.2 to 0.3 s)."""
    hand_speed_m_s: float = 0.2
    """Mean, of a longer movement; unhurried, for an arm on a table."""
    amplitude_noise: float = 0.05
    """Standard deviation of where a movement ends, of its length (Schmidt et al. 1979)."""
    undershoot: float = 0.05
    """Share by which a movement is planned too short on purpose (Meyer et al. 1988)."""
    tremor_m: float = 0.05e-3
    """RMS, 8 to 12 Hz (50 to 200 um: Riviere et al.; Wells et al. 2013)."""
    tremor_Hz: float = 10.0
    drift_m: float = 0.08e-3
    """RMS of the slow wandering of a hand held still (Riviere, Rader & Khosla 1997: 49 um, eye
    surgeons; Wells et al. 2013: 144 um in space while pointing)."""
    drift_s: float = 1.0
    """Time over which it wanders: it lies below 2 Hz (Riviere, Rader & Khosla 1997)."""
    press_jolt_m: float = 0.13e-3
    """RMS by which closing a button moves the hand (133 um while actuating, the same; for
    tracked pointers Wolf et al. 2020)."""
    master_step_m: float = 0.06e-3
    """Resolution of the master (Tremblay, section 2.5.1)."""
    frame_s: float = 0.04
    """Between two pictures: 25 a second."""
    overview_pixel_m: float = 1.25e-3
    """Of the picture of the whole grid: 800 mm over 640 pixels."""
    sight_pixel_m: float = 0.19e-3
    """Of the picture through the sight: 120 mm over 640 pixels, assumed."""
    sight_reach_m: float = 0.05
    """How far off the target may be to be seen through the sight."""
    tolerance_m: float = 0.75e-3
    """What is good enough, each way: with it the path takes as long as in table 2.2. The sight has
    lines 1 mm thick (section 2.6)."""
    tries: int = 3
    """Corrections after which the operator begins to be content with less."""
    impatience: float = 0.25
    """By how much more of `tolerance_m`, for each further correction."""
    look_s: float = 0.28
    """For how long a picture has to stand still to be judged."""
    still_m: float = 0.2e-3
    """What may move meanwhile: a pixel; and what the hand moves itself, by a step of the master."""
    patience_s: float = 2.0
    """How long the operator waits for that, before judging a picture that moves."""


@dataclass(frozen=True)
class Station:
    """What the operator has besides a stylus; the thesis' system had neither."""

    clutch: bool = True
    """A button that takes the hand off the robot: pressed before looking and confirming."""
    steady: bool = True
    """Whether the hand's position is filtered before it is sent, see `PositionFilter`."""
