"""Puts the report together."""

from __future__ import annotations

import math
from collections.abc import Mapping
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_profiles import Winch
from cdpr_rt.identification.rawlog import read_raw_log
from cdpr_rt.procedures.commissioning.commission_files import Paths
from cdpr_rt.procedures.commissioning.evaluation import METHODS
from cdpr_rt.procedures.commissioning.identified import Identified, identify, validation_name
from cdpr_tools.errors import BadInputError
from cdpr_tools.output import to_json
from cdpr_tools.recordings.truth import Truth
from cdpr_tools.report import curves, figures, tables, words
from cdpr_tools.report.curves import Ramp
from cdpr_tools.report.figures import Deviation
from cdpr_tools.report.save import check, save
from cdpr_tools.report.text import number, page, paragraph, picture, plain, section

_SPEEDS_RAD_S = (math.radians(1.0), math.radians(600.0))
_ORDERS_SHOWN = 100


def build(
    paths: Paths, winch: Winch, results: dict[str, Any], found: Identified | None = None
) -> None:
    """Write the report's page and the results beside it.

    `found` spares identifying anew. Raises WorkFailedError where a file cannot be written,
    BadInputError for incomplete results or a missing simulator's log, RawLogError and
    IdentificationError for recordings that are missing or of no use.
    """
    check(results, paths.results)
    save(paths.results, to_json(results, indent=1) + "\n")
    found = found or identify(winch, results["latency_s"], paths)
    save(paths.page, _Report(paths, winch, results, found).html())


class _Report:
    """One report while it is put together."""

    def __init__(
        self, paths: Paths, winch: Winch, results: dict[str, Any], found: Identified
    ) -> None:
        self._paths = paths
        self._winch = winch
        self._results = results
        self._found = found
        self._validation: dict[str, Any] = results["validation"]
        self._true = self._validation["judged_on"] == "true angle"
        self._pictures = 0

    def html(self) -> str:
        """Return the page."""
        title = f"Commissioning of {self._winch.name}"
        truth = Truth(self._paths.truth) if self._true else None
        ramps = {m: curves.read_ramp(self._passes(m)[0], truth) for m in METHODS}
        judged = words.judged_on(self._validation, len(self._passes("better")))
        found = self._found
        methods = words.method_words(self._validation, found.thesis, found.harmonic, ramps)
        parts = [
            f"<h1>{escape(title)}</h1>",
            paragraph(self._motor_and_drive(), small=True),
            self._verdict(),
            tables.summary(self._validation, self._results["bandwidth_Hz"]),
            paragraph(judged, small=True),
            section("Torque over a turn", *self._torque()),
            section("What was identified", *self._identified()),
            section("Validation on a ramp of 22 deg/s", *self._ramp(ramps)),
            section("The thesis’ method beside the harmonic model", *map(paragraph, methods)),
            section("Softer and stiffer loops", *self._bandwidths()),
            section("What is left", *self._residual()),
            section("What to do next", *map(paragraph, words.next_words(self._results))),
            section("Bus and files", tables.bus(self._results["bus"]), self._files()),
        ]
        return page(title, "\n".join(parts))

    def _picture(self, source: str, what: str, caption: str) -> str:
        self._pictures += 1
        return picture(source, self._pictures, what, caption)

    def _recorded(self, name: str) -> list[Path]:
        found = self._paths.passes(name)
        if not found:
            raise BadInputError(f"{self._paths.raw(name + '-0')}: the recording is missing")
        return found

    def _passes(self, method: str) -> list[Path]:
        return self._recorded(validation_name(method, self._results["bandwidth_Hz"]))

    def _motor_and_drive(self) -> str:
        motor, drive = self._winch.motor, self._results["drive"]
        if isinstance(drive, Mapping):
            ids = ", ".join(
                f"{key.replace('_', ' ')} {drive[key]:08X}h"
                for key in ("vendor_id", "product_code", "revision")
                if key in drive
            )
            drive = f"{drive.get('name', '')} ({ids}, serial {drive.get('serial', '?')})"
        return (
            f"{self._results['winch']} · motor {motor.manufacturer} {motor.model} "
            f"({motor.poles} poles, {number(motor.rated_torque_Nm)} Nm, "
            f"{number(motor.torque_constant_Nm_per_Arms)} Nm/A) · drive {drive} · encoder "
            f"{self._results['encoder_counts_per_turn']} counts a turn · bus "
            f"{self._results['bus'].get('url', '?')} · {self._results['date']}"
        )

    def _verdict(self) -> str:
        good = not words.missed_targets(self._validation, "better")
        lines = "".join(
            f"<p><b>{who}</b>{escape(words.verdict(self._validation, method))}</p>"
            for method, who in (("better", "The harmonic model"), ("thesis", "The thesis’ method"))
        )
        return f'<div class="verdict{"" if good else " missed"}">{lines}</div>'

    def _torque(self) -> list[str]:
        thesis, harmonic = self._found.thesis, self._found.harmonic
        speed = abs(read_raw_log(self._recorded("sweep")[0]).header["speed_rad_s"])
        order = curves.strongest_order(harmonic)
        shift = curves.shift_deg(thesis.raw_Nm, order)
        means = " and ".join(number(1e3 * one) for one in thesis.mean_Nm)
        frictions = " and ".join(number(1e3 * one) for one in curves.friction_Nm(harmonic, speed))
        share = f"{number(100 * thesis.repaired_fraction, 2)} % of the curves, in which the rotor "
        return [
            paragraph(
                f"The motor was swept at {number(math.degrees(speed), 2)} deg/s over "
                f"{_turns(thesis.turns[0])} with increasing and {_turns(thesis.turns[1])} with "
                "decreasing angle under a stiff proportional controller, without load. The torque "
                "this took is averaged at equal angles. The gap between the two directions is "
                "friction; what they have in common is cogging."
            ),
            self._picture(
                figures.raw_curves(thesis.raw_Nm),
                "Torque over one turn in both directions",
                "Torque commanded over one turn from the encoder index, averaged (thesis, figure "
                "1.4). Sudden steps towards zero are places where the rotor broke loose.",
            ),
            self._picture(
                figures.overlay(thesis.raw_Nm, order),
                "Both directions over one period of the strongest order",
                f"Both directions about their means over one period of order {order} (thesis, "
                f"figure 1.5). In that order the two are {number(abs(shift), 2)} deg apart, each "
                f"{words.lag_text(shift / 2)} in the sense of its motion.",
            ),
            self._picture(
                figures.tables(
                    thesis.raw_Nm,
                    thesis.curve_Nm,
                    harmonic.tables(thesis.raw_Nm.shape[1]) + thesis.mean_Nm[:, None],
                    thesis.repaired,
                ),
                "Measured torque with the curves of both methods, for each direction",
                "Measured torque, the thesis’ curve (average, filter of degree 2 over 5 deg, "
                "repair) and the harmonic model (thesis, figures 1.6 and 1.7). "
                + (
                    f"Shaded: {share}ran away and the other direction’s curve was used. "
                    if thesis.repaired.any()
                    else "Nowhere did the rotor run away, so nothing was repaired. "
                )
                + f"The model is drawn about the measured means, {means} mNm; its own friction at "
                f"this speed is {frictions} mNm.",
            ),
        ]

    def _identified(self) -> list[str]:
        facts = self._results["identification"]
        orders = facts["orders"]
        amplitudes, widths, held_back = (
            np.asarray(facts[key], float)
            for key in ("amplitudes_Nm", "confidence_Nm", "held_back_error_Nm")
        )
        return [
            paragraph(
                "The harmonic model is one least-squares fit of cogging, friction of each "
                "direction, inertia and delay to the recorded runs, made anew from a second pass "
                "under compensation. Orders are ranked by significance, and as many are taken as "
                "help to predict turns that were held back from the fit."
            ),
            self._picture(
                figures.spectrum(orders, amplitudes, widths, held_back),
                "Amplitude of each order, and the choice of their number",
                f"Left: {_orders(len(orders))}, with 95 % confidence intervals. Right: the error "
                "on held-back turns with ever more orders, and how many were taken: the fewest "
                "that are as good as the best within one standard error.",
            ),
            tables.harmonics(facts),
            self._friction(),
            tables.estimates(self._found.harmonic),
            tables.quality(facts),
        ]

    def _friction(self) -> str:
        speed = np.geomspace(*_SPEEDS_RAD_S, 200)
        both = np.array([curves.friction_Nm(self._found.harmonic, one) for one in speed.tolist()])
        return self._picture(
            figures.friction(speed, both[:, 0], both[:, 1]),
            "Friction over speed in both directions",
            "Friction of the harmonic model over the speed, from 1 deg/s to that of the fastest "
            "recorded turns. Where it falls, a rotor under a soft loop sticks and slips.",
        )

    def _ramp(self, ramps: dict[str, Ramp]) -> list[str]:
        floor = self._validation["floor"]
        time_s = max((ramp.time_s for ramp in ramps.values()), key=len)
        of = "true angle" if self._true else "angle on the encoder"
        drawn = (
            ("position_error_deg", "position error (deg)", "rms_position_error_deg",
             "floor (rms, deg)",
             f"Deviation of the {of} from the ramp, increasing angle (thesis, figure 1.9)."),
            ("effort_Nm", "PID effort (Nm)", "peak_pid_effort_Nm", "floor (peak, Nm)",
             "What the PID had to do beside the compensation, about its mean (thesis, 1.9)."),
            ("velocity_error_deg_s", "velocity error (deg/s)", "peak_velocity_error_deg_s",
             "floor (peak, deg/s)",
             f"Deviation of the velocity of the {of} from 22 deg/s, through a 50 Hz low-pass "
             "(thesis, figure 1.10)."),
        )  # fmt: skip
        pictures = [
            self._picture(
                figures.deviations(
                    time_s,
                    {method: getattr(ramp, key) for method, ramp in ramps.items()},
                    Deviation(label, floor[figure], floor_label),
                ),
                f"Time course of the {label} without and with compensation",
                caption,
            )
            for key, label, figure, floor_label, caption in drawn
        ]
        encoder_deg = 360.0 / self._results["encoder_counts_per_turn"]
        torque_Nm = float(self._results["torque_step_Nm"])
        return [
            paragraph(words.loop_words(self._results["pid"][0])),
            paragraph(words.standstill_words(ramps)),
            *pictures,
            *map(paragraph, words.floor_words(self._validation, encoder_deg, torque_Nm)),
            *([tables.on_encoder(self._validation["encoder"])] if self._true else []),
        ]

    def _bandwidths(self) -> list[str]:
        rows, default = self._validation["bandwidths"], self._results["bandwidth_Hz"]
        introduction = paragraph(
            "How much compensation gains depends on the loop it helps: a soft loop leaves much to "
            "win, a stiff one little, and every stiff loop ends at the floor. "
            + (
                "So the same runs were made with loops of other bandwidths, all tuned by the same "
                "margins."
                if len(rows) > 1
                else "This commissioning was made at one bandwidth only."
            )
        )
        loops = tables.loops(rows, self._results["bandwidths_Hz"], self._results["pid"])
        if len(rows) == 1:
            return [introduction, loops]
        drawn = self._picture(
            figures.bandwidths(rows, default, self._validation["targets"]),
            "The three figures and their ratios over the bandwidth of the loop",
            "Left: what each method leaves; right: how many times smaller that is than without. "
            f"The short bars at {plain(default)} Hz are what was asked there.",
        )
        return [introduction, drawn, loops]

    def _residual(self) -> list[str]:
        left = curves.read_residual_effort(self._passes("better"), _ORDERS_SHOWN)
        facts = self._results["identification"]
        sentences = words.residual_words(left, facts["residual_rms_Nm"])
        return [
            *map(paragraph, sentences),
            self._picture(
                figures.residual_effort(left, facts["orders"]),
                "PID effort under the harmonic model over the turn, and its orders",
                "PID effort under the harmonic model over the turn about its mean, and its "
                "orders; shaded: the orders that the model has.",
            ),
        ]

    def _files(self) -> str:
        return paragraph(
            f"Beside this page: {self._paths.results.name} (these figures), "
            f"{self._paths.profile.name} (what the controller uses) and raw/ (every run as "
            "recorded, from which all of this can be made again).",
            small=True,
        )


def _turns(count: int) -> str:
    return "one turn" if count == 1 else f"{count} turns"


def _orders(count: int) -> str:
    """Say how many orders were found."""
    return {0: "no order was found", 1: "the one order found"}.get(count, f"the {count} orders")
