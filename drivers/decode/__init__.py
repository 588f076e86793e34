"""What the frames on a CANopen bus mean: decoding for monitors, logs and captures; never sends."""

from drivers.decode.candump import LogError, Logged, format_line, parse_line, read_log
from drivers.decode.decoder import Decoder, KnownNode, Record
from drivers.decode.frame import Frame

__all__ = [
    "Decoder",
    "Frame",
    "KnownNode",
    "LogError",
    "Logged",
    "Record",
    "format_line",
    "parse_line",
    "read_log",
]
