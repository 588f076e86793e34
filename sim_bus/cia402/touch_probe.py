"""Touch probes (60B8h to 60BDh), both on the encoder's zero pulse."""

from __future__ import annotations

from collections.abc import Callable

from cdpr_sim_bus.canopen.abort import Abort, SdoAbort
from cdpr_sim_bus.canopen.dictionary.datatypes import Value
from cdpr_sim_bus.canopen.dictionary.od import Entry
from cdpr_sim_bus.cia402.axis import Axis, to_int32
from cdpr_sim_bus.robot import motor_physics

_ENABLE = 0x01
_CONTINUOUS = 0x02
_SOURCE = 0x0C
_ZERO_PULSE = 0x04
_SOURCE_OBJECT = 0x08
_EDGES = 0x30
_ZERO_PULSE_IN_60D0 = {5, 6}
_TOGGLES = 0xC0
_PULSE_EDGES = (
    (motor_physics.INDEX_ROSE, 0, "rise_count"),
    (motor_physics.INDEX_FELL, 1, "fall_count"),
)


class TouchProbes:
    """Latches the position at edges of the zero pulse.

    Low byte of 60B8h: bit 0 enable, bit 1 continuous (else the first event only), bits 3 and 2
    the source (01 zero pulse, 10 as in 60D0h), bits 4 and 5 the positive and negative edge; high
    byte the same for probe 2. In 60B9h bit 0 shows enabled, bits 1 and 2 a stored positive and
    negative edge, and bits 6 and 7 of a continuous probe toggle with every positive and negative
    edge. The positive edge is the beginning of the pulse, in whichever direction it is met.
    """

    def __init__(self, axis: Axis) -> None:
        self._axis = axis
        self._status: Entry = axis.od.entry(0x60B9)
        self._latches = [[axis.od.entry(0x60BA + 2 * k + edge) for edge in (0, 1)] for k in (0, 1)]
        self._function = 0
        axis.od.on_write(0x60B8, 0, self._command)
        for sub in (1, 2):
            if (0x60D0, sub) in axis.od:
                axis.od.on_write(0x60D0, sub, self._source_writer(sub))
        self.watching = 0
        """Flags of `motor.run` that matter now."""

    def reset(self) -> None:
        """Disable both probes."""
        self._apply(0)

    def latch(self, edges: int) -> None:
        """Store the position of the index edges that the last step saw."""
        motor, status = self._axis.motor, int(self._status.value)
        for bit, edge, field in _PULSE_EDGES:
            if not edges & bit:
                continue
            position = to_int32(int(motor[field][0]) + self._axis.position_offset)
            for k in (0, 1):
                setting = self._function >> 8 * k & 0xFF
                if not setting & _ENABLE or not setting & (0x10 << edge):
                    continue
                stored = 0x02 << edge + 8 * k
                if setting & _CONTINUOUS:
                    status ^= 0x40 << edge + 8 * k
                elif status & stored:
                    continue
                status |= stored
                self._latches[k][edge].value = position
        self._status.value = status

    def _command(self, value: Value) -> None:
        function = int(value)
        if function == self._function:
            return
        for k in (0, 1):
            setting = function >> 8 * k & 0xFF
            if setting & _ENABLE and not self._uses_pulse(k, setting):
                raise SdoAbort(Abort.INVALID_VALUE)
        self._apply(function)

    def _uses_pulse(self, k: int, setting: int) -> bool:
        source = setting & _SOURCE
        if source == _SOURCE_OBJECT:
            return self._axis.od.get_int(0x60D0, k + 1, 0) in _ZERO_PULSE_IN_60D0
        return source == _ZERO_PULSE

    def _apply(self, function: int) -> None:
        status, watching = int(self._status.value), 0
        for k in (0, 1):
            new, old = function >> 8 * k & 0xFF, self._function >> 8 * k & 0xFF
            if not new & _ENABLE:
                status &= ~(0xFF << 8 * k)
                continue
            # Taking an edge out of the function, or enabling the probe, arms that edge again.
            going_on = old & new & _EDGES if old & _ENABLE else 0
            kept = going_on >> 3 | (_TOGGLES if going_on else 0)
            status = status & ~((0xFF & ~kept) << 8 * k) | _ENABLE << 8 * k
            watching |= self._edges(new)
        self._status.value = status
        self._function = function
        self.watching = watching

    @staticmethod
    def _edges(setting: int) -> int:
        return (motor_physics.INDEX_ROSE if setting & 0x10 else 0) | (
            motor_physics.INDEX_FELL if setting & 0x20 else 0
        )

    def _source_writer(self, sub: int) -> Callable[[Value], None]:
        def write(_value: Value) -> None:
            if self._function >> 8 * (sub - 1) & _ENABLE:
                raise SdoAbort(Abort.DEVICE_STATE)

        return write
