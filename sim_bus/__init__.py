"""Slave side: simulated bus, CANopen drives and motor physics."""
