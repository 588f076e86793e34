"""Program `follow`: single cables follow the set-point stream."""

from __future__ import annotations

from typing import Any

import numpy as np

from cdpr_rt.arrays import FloatArray
from cdpr_rt.core.exchange import AxisFeedback, Setpoint
from cdpr_rt.jit import jit
from cdpr_rt.motion.pose_stream import PoseStream, StreamState
from cdpr_rt.motion.trajectory import approach
from cdpr_rt.programs.axis_program import AxisProgram, BumplessController
from cdpr_rt.programs.model import AxesModel

_LEAD_S = 0.3


@jit
def _lead(
    scale: float,
    pose: FloatArray,
    last: FloatArray,
    cable: FloatArray,
    speed: FloatArray,
    acceleration: FloatArray,
    position: FloatArray,
    target: FloatArray,
) -> None:
    """Add the stream's motion to the targets, which stay within the axes' stopping distance."""
    for i in range(min(3, target.size)):
        target[i] += scale * (pose[i] - last[i]) / cable[i]
        # an axis that is slower than the stream must not continue after the stream has stopped
        reach = speed[i] * (0.5 * speed[i] / acceleration[i] + _LEAD_S)
        target[i] = min(max(target[i], position[i] - reach), position[i] + reach)
        last[i] = pose[i]


class FollowProgram(AxisProgram):
    """Pays out cable according to the stream: x, y and z are the axes 0, 1 and 2.

    The axes follow the displacement since the stream began, multiplied by its scale; all other axes
    hold. Without new samples the motion ends at the last one. After the timeout of the stream the
    axes brake.
    """

    name = "follow"
    needs_lease = True

    def __init__(self, model: AxesModel, loop: BumplessController, stream: PoseStream) -> None:
        super().__init__(model, loop)
        self.stream = stream
        self._epoch = -1
        self._last = np.zeros(3)
        self._target = np.zeros(model.n)
        # this call compiles the kernel before the cycle in which the stream begins
        self._follow(np.zeros(model.n), 0.0)

    def start(self, feedback: AxisFeedback, setpoint: Setpoint, torque_Nm: FloatArray) -> None:
        """Continue from the last set-point and torque; brake until the stream begins."""
        super().start(feedback, setpoint, torque_Nm)
        # targets are where the axes come to rest, because the stream may begin before they do
        speed = setpoint.velocity_rad_s
        braked = 0.5 * speed * np.abs(speed) / self._model.acceleration_rad_s2
        self._target[:] = setpoint.position_rad + braked
        self.stream.reset()

    @property
    def stream_age_s(self) -> float:
        """Return the age of the newest sample of the stream, nan before the first."""
        return self.stream.age_s

    @property
    def stream_buttons(self) -> int:
        """Return the buttons of the present sample."""
        return self.stream.buttons

    def progress(self) -> dict[str, Any]:
        """Return the stream's state and the numbers of samples accepted and rejected."""
        stream = self.stream
        return {
            "stream": stream.state.name.lower(),
            "session": stream.session,
            "delay_s": stream.delay_s,
            **stream.counts(),
        }

    def _move(self, setpoint: Setpoint) -> bool:
        stream, model = self.stream, self._model
        if stream.update() is StreamState.STOPPED:
            at_rest = self._brake(setpoint)
            self._target[:] = setpoint.position_rad
            return at_rest
        if stream.epoch != self._epoch:
            self._epoch = stream.epoch
            self._last[:] = stream.pose[:3]
        self._follow(setpoint.position_rad, stream.scale)
        bounds = model.speed_rad_s, model.acceleration_rad_s2, model.period_s
        approach(self._target, *bounds, *setpoint.arrays)
        return False

    def _follow(self, position_rad: FloatArray, scale: float) -> None:
        """Move the targets by the motion of the stream, multiplied by `scale`."""
        model = self._model
        _lead(
            scale, self.stream.pose, self._last, model.cable_m_per_rad, model.speed_rad_s,
            model.acceleration_rad_s2, position_rad, self._target,
        )  # fmt: skip
