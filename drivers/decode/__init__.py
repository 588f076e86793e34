"""Decoding of CANopen frames for monitors, logs and captures; it never sends."""

from cdpr_drivers.decode.candump import Frame, LogEntry, LogError, format_line, parse_line, read_log
from cdpr_drivers.decode.decoder import Decoder, KnownNode, Record

__all__ = [
    "Decoder",
    "Frame",
    "KnownNode",
    "LogEntry",
    "LogError",
    "Record",
    "format_line",
    "parse_line",
    "read_log",
]
