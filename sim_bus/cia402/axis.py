"""One motor under the drive's firmware: reads objects of the dictionary, writes feedback."""

from __future__ import annotations

import math
from collections.abc import Callable

from cdpr_profiles.jit import bound
from cdpr_sim_bus.canopen.abort import Abort, SdoAbort
from cdpr_sim_bus.canopen.od import Entry, ObjectDictionary, Value
from cdpr_sim_bus.cia402.drive_quirks import DriveQuirks
from cdpr_sim_bus.robot import motor_state, servo
from cdpr_sim_bus.robot.cable_robot import CableRobot, MotorSample, RobotMember
from cdpr_sim_bus.robot.motor import INDEX_FELL, INDEX_ROSE, restart_counter, run
from cdpr_sim_bus.robot.plant import Plant

_WINDOW_OFF = 0xFFFFFFFF
_JAM_Nm = 1e6


def to_int32(value: int) -> int:
    """Wrap a count into the range of INTEGER32 objects."""
    return (value + 0x80000000 & 0xFFFFFFFF) - 0x80000000


class Axis:
    """Power stage, inner loops and feedback of one motor.

    Positions here are encoder counts from power-up; `position_offset` converts them to those of the
    dictionary (position actual = counter + offset). Inner loops work in counts; `velocity` reads
    objects in the drive's own unit (see `quirks`).
    """

    def __init__(
        self,
        od: ObjectDictionary,
        plant: Plant,
        ratings: motor_state.MotorRatings,
        transmission: motor_state.Transmission | None = None,
        quirks: DriveQuirks | None = None,
        robot: RobotMember | None = None,
    ) -> None:
        self.od = od
        self.plant = plant
        self.ratings = ratings
        self.quirks = quirks or DriveQuirks()
        self.velocity_unit = (
            plant.encoder.counts_per_turn / 60.0 if self.quirks.velocity_in_rpm else 1.0
        )
        """Counts/s of one velocity unit, counts/s² of one acceleration unit."""
        self.motor = motor_state.build_motor(plant, ratings, transmission)
        self._robot = robot
        if robot is not None:
            self.motor = robot.adopt(self.motor, self._command)
        self._advance = bound(run, self.motor, then=(0.0, 0, 0.0))
        self.kind = servo.OFF
        self.target = 0.0
        self.setpoint: Callable[[], float] | None = None
        """Returns the target for every step, if a mode follows an object."""
        self.time = 0.0
        self.flags = 0
        self.cell_off_N = 0.0
        """Deviation of the cable's load cell from the tension."""
        self.cable_cut = False
        self.slipped_m = 0.0
        """Length that fault injection has let slip through the cable's fastening."""
        self.brake_applied = False
        """Whether the safety I/O applies the brake."""
        self.brake_fault = ""
        """Injected fault: "worn" if the brake never holds, "stuck" if it always holds."""
        self._index_missed = False
        self.jammed = False
        """Injected fault: whether the drum does not turn because its cable is caught."""
        self.position_offset = 0
        self._lowest, self._highest = -math.inf, math.inf
        self.clipped = False
        """Whether a software limit (607Dh) limits the target."""
        self._position = od.entry(0x6064)
        self._torque = od.entry(0x6077)
        self.sample = self._run(0.0)
        self._bind_feedback()

    def step(self, until: float) -> int:
        """Advance physics and inner loops to bus time `until`; return the flags of `motor.run`."""
        self.sample = sample = self._run(until)
        self.time = until
        counts = sample[1] + self.position_offset
        if not -0x80000000 <= counts <= 0x7FFFFFFF:
            counts = to_int32(counts)
        self._position.value = counts
        self._torque.value = sample[2]
        self.flags = sample[0]
        return self.flags

    def prepare(self, until: float) -> None:
        """Compute the step to `until` in advance, if that can be done."""
        if self._robot is not None:
            self._robot.prepare(until)

    def _run(self, until: float) -> MotorSample:
        if self._robot is not None:
            return self._robot.step(until)
        if self.setpoint is not None:
            self.target = self.setpoint()
        sample: MotorSample = self._advance(until, self.kind, self.target)
        return sample

    def _command(self) -> tuple[int, float]:
        if self.setpoint is not None:
            self.target = self.setpoint()
        return self.kind, self.target

    def drive(self, kind: int, target: float) -> None:
        """Switch the power stage on in a kind of control (named in `servo`)."""
        self.kind = kind
        self.target = target
        self.setpoint = None
        self.flags &= ~(servo.ON_TARGET | servo.REFERENCE_DONE | servo.FOLLOWING_ERROR)

    def switch_off(self) -> None:
        """Switch the power stage off: the motor coasts."""
        self.drive(servo.OFF, 0.0)

    def reboot(self) -> None:
        """Restart as at power-up, at the same angle: an incremental encoder loses its position."""
        self.switch_off()
        restart_counter(self.motor)
        self.position_offset = 0
        self.motor["observed_position"] = 0.0
        self.motor["i2t"] = 0.0
        self.configure()

    def jump(self, counts: int) -> None:
        """Make the encoder miscount once; its index pulse stays at the same rotor angle."""
        self.motor["zero"] -= counts

    def freeze_encoder(self, frozen: bool) -> None:
        """Stop the encoder's counter; later it continues from there, so that counts are lost."""
        m = self.motor
        if frozen and not m["frozen"][0]:
            m["frozen_count"] = self.sample[1]
        elif m["frozen"][0] and not frozen:
            m["zero"] = m["disc"] - m["frozen_count"]
        m["frozen"] = frozen
        self._update_index()

    def miss_index(self, missed: bool) -> None:
        """Let the encoder give no index pulse."""
        self._index_missed = missed
        self._update_index()

    def _update_index(self) -> None:
        present = self.plant.encoder.index_present and not self._index_missed
        self.motor["index_present"] = present and not self.motor["frozen"][0]

    def stick_torque(self, stuck: bool) -> None:
        """Let the power stage keep its present torque while it is on."""
        self.motor["torque_stuck"] = self.motor["torque_demand"] if stuck else math.nan

    def jam(self, jammed: bool) -> None:
        """Catch the cable at the drum, or release it."""
        self.jammed = jammed
        self.update_brake()

    def break_brake(self, fault: str) -> None:
        """Give the brake a fault, see `brake_fault`; "" repairs it."""
        self.brake_fault = fault
        self.update_brake()

    def update_brake(self) -> None:
        """Let the brake, or a caught cable, hold the rotor."""
        holds = (self.brake_applied or self.brake_fault == "stuck") and self.brake_fault != "worn"
        brake_Nm = self.plant.motor.brake_torque_Nm if holds else 0.0
        self.motor["brake"] = _JAM_Nm if self.jammed else brake_Nm

    @property
    def body(self) -> CableRobot | None:
        """The robot whose platform the cable moves."""
        return None if self._robot is None else self._robot.robot

    @property
    def has_cable(self) -> bool:
        """Whether there is a cable."""
        return self._robot is not None or self.plant.load.kind != "none"

    def cut_cable(self) -> None:
        """Cut the cable."""
        if self._robot is not None:
            self._robot.cut()
        else:
            motor_state.remove_cable(self.motor)
        self.cable_cut = True

    def slip_cable(self, metres: float) -> None:
        """Let a length of cable slip at its fastening on the drum."""
        if self._robot is not None:
            self._robot.slip(metres)
        else:
            motor_state.lengthen_cable(self.motor, metres)
        self.slipped_m += metres

    def mend_cable(self) -> None:
        """Attach the cable again and fasten it on the drum."""
        if self._robot is not None:
            self._robot.mend(self.cable_cut, self.slipped_m)
        elif self.has_cable:
            motor_state.mend_cable(self.motor, self.plant.load, self.slipped_m)
        self.cable_cut, self.slipped_m = False, 0.0

    @property
    def cable_state(self) -> str:
        """Return "none", "cut", "caught", "slipped" or "intact"."""
        if not self.has_cable:
            return "none"
        states = {"cut": self.cable_cut, "caught": self.jammed, "slipped": self.slipped_m}
        return next((name for name, holds in states.items() if holds), "intact")

    def read(self, field: str) -> float:
        """Return a field of the motor's record."""
        return float(self.motor[field][0])

    def object(self, index: int, sub: int = 0) -> int:
        """Return the value of an integer object."""
        return self.od.get_int(index, sub)

    def velocity(self, index: int, sub: int = 0) -> float:
        """Return the value of a velocity or acceleration object, in counts/s or counts/s²."""
        return self.od.get_int(index, sub) * self.velocity_unit

    def configure(self) -> None:
        """Read limits and windows from the dictionary."""
        get, m = self.od.get_int, self.motor
        constant = self.ratings.torque_constant_Nm_per_Arms
        unit = self.quirks.unit_Nm(get(0x6076) * self.quirks.rated_torque_unit_Nm, constant)
        m["torque_unit"] = unit
        m["rated_current"] = get(0x6075) * 1e-3 * constant
        peak = min(self.ratings.peak_torque_Nm, get(0x6073) * get(0x6075) * 1e-6 * constant)
        most = min(peak, get(0x6072) * unit)
        m["limit_positive"] = min(most, get(0x60E0) * unit)
        m["limit_negative"] = min(most, get(0x60E1) * unit)
        speed = get(0x6080) / 60.0 * self.plant.encoder.counts_per_turn
        m["speed_limit"] = speed
        m["overspeed"] = self.plant.drive.overspeed_ratio * speed
        window = get(0x6065)
        m["following_window"] = math.inf if window == _WINDOW_OFF else window
        m["following_time"] = get(0x6066) * 1e-3
        m["standstill_velocity"] = self.velocity(0x606F)
        m["standstill_time"] = get(0x6070) * 1e-3
        low, high = get(0x607D, 1), get(0x607D, 2)
        self._lowest, self._highest = (low, high) if low < high else (-math.inf, math.inf)

    @property
    def speed_limit(self) -> float:
        """Highest velocity that a profile may request, counts/s."""
        return min(self.velocity(0x607F), self.read("speed_limit"))

    def set_ramps(self, acceleration: float, deceleration: float) -> None:
        """Set the ramps of the velocity and position profile, counts/s², within 60C5h, 60C6h."""
        self.motor["acceleration"] = min(acceleration, self.velocity(0x60C5))
        self.motor["deceleration"] = min(deceleration, self.velocity(0x60C6))

    def set_steps(self) -> None:
        """Make velocity references act without a ramp."""
        self.motor["acceleration"] = self.motor["deceleration"] = math.inf

    def set_torque_slope(self, units_s: float) -> None:
        """Set the torque slope, torque units per second."""
        self.motor["torque_slope"] = units_s * self.read("torque_unit")

    def set_window(self, window: float, time_s: float) -> None:
        """Set the window around the target and how long the value must stay in it."""
        self.motor["target_window"] = math.inf if window == _WINDOW_OFF else window
        self.motor["target_window_time"] = time_s

    def clip_position(self, position: float) -> float:
        """Limit a target position of the dictionary to 607Dh; return it as counter value."""
        clipped = max(self._lowest, min(self._highest, position))
        self.clipped = clipped != position
        return float(clipped - self.position_offset)

    def digital_inputs(self) -> int:
        """Return 60FDh: bit 0 negative limit, 1 positive limit, 2 home switch."""
        return (self.flags // servo.SWITCH_NEGATIVE) & 0b111

    def _velocity_units(self, counts_s: float) -> int:
        return round(counts_s / self.velocity_unit)

    def _bind_feedback(self) -> None:
        od = self.od
        dictionary: dict[int, Callable[[], int]] = {
            0x6062: lambda: to_int32(round(self.read("reference_position")) + self.position_offset),
            0x6063: lambda: to_int32(self.sample[1]),
            0x6069: lambda: round(self.read("observed_velocity")),
            0x606B: lambda: self._velocity_units(self.read("reference_velocity")),
            0x606C: lambda: self._velocity_units(self.sample[3]),
            0x6074: lambda: round(self.read("torque_demand") / self.read("torque_unit")),
            0x6078: lambda: round(1000.0 * self.read("sensed") / self.read("rated_current")),
            0x60F4: lambda: round(self.read("reference_position") - self.read("observed_position")),
            0x60FC: lambda: to_int32(round(self.read("reference_position"))),
            0x60FD: self.digital_inputs,
        }
        for index, getter in dictionary.items():
            if (index, 0) in od:
                od.on_read(index, 0, getter)


# Touch probes (60B8h to 60BDh), both on the encoder's zero pulse.

_ENABLE = 0x01
_CONTINUOUS = 0x02
_SOURCE = 0x0C
_ZERO_PULSE = 0x04
_SOURCE_OBJECT = 0x08
_EDGES = 0x30
_ZERO_PULSE_IN_60D0 = {5, 6}
_TOGGLES = 0xC0
_PULSE_EDGES = (
    (INDEX_ROSE, 0, "rise_count"),
    (INDEX_FELL, 1, "fall_count"),
)


class TouchProbes:
    """Latches the position at edges of the zero pulse.

    Bits of 60B8h: 0 enables probe 1, 1 makes it continuous (else it latches only the first event),
    3 and 2 select the source (01 zero pulse, 10 as in 60D0h), 4 and 5 select the positive and
    negative edge. Bits of 60B9h: 0 shows enabled, 1 and 2 a stored positive and negative edge. Bits
    6 and 7 of a continuous probe toggle with every positive and negative edge. The high bytes are
    the same for probe 2. The positive edge is the beginning of the pulse, in either direction of
    motion.
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
        """Store the position of the index edges that occurred in the last step."""
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
            # A probe is armed again for an edge if the edge is removed from the function, or if the
            # probe is enabled.
            going_on = old & new & _EDGES if old & _ENABLE else 0
            kept = going_on >> 3 | (_TOGGLES if going_on else 0)
            status = status & ~((0xFF & ~kept) << 8 * k) | _ENABLE << 8 * k
            watching |= self._edges(new)
        self._status.value = status
        self._function = function
        self.watching = watching

    @staticmethod
    def _edges(setting: int) -> int:
        return (INDEX_ROSE if setting & 0x10 else 0) | (INDEX_FELL if setting & 0x20 else 0)

    def _source_writer(self, sub: int) -> Callable[[Value], None]:
        def write(_value: Value) -> None:
            if self._function >> 8 * (sub - 1) & _ENABLE:
                raise SdoAbort(Abort.DEVICE_STATE)

        return write
