"""Figures for Prometheus."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Iterator
from typing import Any, Final

import numpy as np
from prometheus_client import CollectorRegistry, generate_latest
from prometheus_client.core import (
    CounterMetricFamily,
    GaugeMetricFamily,
    HistogramMetricFamily,
    Metric,
)
from prometheus_client.registry import Collector

from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.cycle_row import AXIS_FIELDS, SCALAR_FIELDS, CycleField, Row
from cdpr_rt.core.shared_block import RowReader
from cdpr_rt.core.states import LoopState
from cdpr_rt.service.link import DEAD, STARTING
from cdpr_rt.service.rows import newest_row
from cdpr_rt.service.service import Service

_READ_S = 0.2
_MOST_ROWS = 2000
_BOUNDS_S: Final = np.array(
    [2e-5, 5e-5, 1e-4, 2e-4, 3e-4, 4e-4, 5e-4, 7e-4, 1e-3, 2e-3, 5e-3, 1e-2, 0.1]
)
_SCALARS: Final = tuple(field for field in SCALAR_FIELDS if field.metric)
_TIMES: Final = tuple(field for field in _SCALARS if field.is_wall_time)
_NUMBERS: Final = tuple(field for field in _SCALARS if field.kind == "<f8" and not field.wall)
_COUNTS: Final = tuple(field for field in _SCALARS if field.kind != "<f8")
_AXES: Final = tuple(field for field in AXIS_FIELDS if field.metric)


class _Histogram:
    """Counts of a duration by size, over all cycles."""

    def __init__(self) -> None:
        self.counts = np.zeros(_BOUNDS_S.size + 1, np.int64)
        self.sum_s = 0.0

    def add(self, values_s: FloatArray) -> None:
        finite = values_s[np.isfinite(values_s)]
        places = np.searchsorted(_BOUNDS_S, finite)
        self.counts += np.bincount(places, minlength=self.counts.size)
        self.sum_s += float(finite.sum())

    def buckets(self) -> list[tuple[str, float]]:
        names = [*(f"{bound:g}" for bound in _BOUNDS_S), "+Inf"]
        return list(zip(names, np.cumsum(self.counts).astype(float).tolist(), strict=True))


class MetricsCollector(Collector):
    """Collects from the rows while `watch` runs, from the rest when it is asked."""

    def __init__(self, service: Service) -> None:
        self._service = service
        self._rows = RowReader(service.block)
        self._times = {field.name: _Histogram() for field in _TIMES}
        self._registry = CollectorRegistry()
        self._registry.register(self)

    def text(self) -> bytes:
        """Return everything in Prometheus' text format."""
        return generate_latest(self._registry)

    async def watch(self) -> None:
        """Count durations of all cycles, until cancelled."""
        while True:
            rows = self._rows.read(_MOST_ROWS)
            for name, histogram in self._times.items():
                histogram.add(rows[name])
            await asyncio.sleep(0.0 if rows.size == _MOST_ROWS else _READ_S)

    def describe(self) -> list[Metric]:
        """Return nothing: which figures there are is known when they are collected."""
        return []

    def collect(self) -> Iterator[Metric]:
        """Return all figures of now."""
        yield from self._of_loop()
        for field in _TIMES:
            histogram = self._times[field.name]
            name = f"cdpr_cycle_{field.metric}_seconds"
            yield HistogramMetricFamily(name, _about(field), histogram.buckets(), histogram.sum_s)
        row = newest_row(self._service.block)
        if row is not None:
            yield from self._of_row(row)
        yield self._of_parts()

    def _of_loop(self) -> Iterator[Metric]:
        service = self._service
        state = GaugeMetricFamily("cdpr_state", "1 for the state the loop is in", labels=["state"])
        now = service.link.state()
        for label in (*(one.label for one in LoopState), STARTING, DEAD):
            state.add_metric([label], float(label == now))
        yield state
        yield GaugeMetricFamily(
            "cdpr_loop_silent_seconds", "Since the loop's last turn", service.link.silent_s()
        )
        held = float(service.lease.holder() is not None)
        yield GaugeMetricFamily("cdpr_control_held", "1 while somebody may move", held)
        yield CounterMetricFamily(
            "cdpr_rows_not_seen", "Cycles missing in the histograms", self._rows.lost
        )

    def _of_row(self, row: Row) -> Iterator[Metric]:
        for field in _COUNTS:
            yield CounterMetricFamily(f"cdpr_{field.metric}", _about(field), int(row[field.name]))
        for field in _NUMBERS:
            if math.isfinite(value := float(row[field.name])):
                yield GaugeMetricFamily(f"cdpr_{field.metric}", _about(field), value)
        axes = self._service.link.description().get("axes") or []
        names = [str(axis.get("name", number)) for number, axis in enumerate(axes)]
        for field in _AXES:
            family = GaugeMetricFamily(f"cdpr_axis_{field.metric}", _about(field), labels=["axis"])
            for name, value in zip(names, row[field.name].tolist(), strict=False):
                if math.isfinite(value):
                    family.add_metric([name], value)
            yield family

    def _of_parts(self) -> Metric:
        family = GaugeMetricFamily(
            "cdpr_part_figure", "What the service's parts tell", labels=["part", "figure"]
        )
        for part, figures in self._service.part_figures().items():
            for name, value in _numbers(figures):
                family.add_metric([part, name], value)
        return family


def _about(field: CycleField) -> str:
    """Return a field's description; no metric is null, unknown values are left out."""
    about = field.meaning.partition("; null")[0]
    return about[0].upper() + about[1:]


def _numbers(figures: dict[str, Any], before: str = "") -> Iterator[tuple[str, float]]:
    for name, value in figures.items():
        if isinstance(value, bool | int | float):
            yield before + name, float(value)
        elif isinstance(value, dict):
            yield from _numbers(value, f"{before}{name}_")
