"""Acyclic CANopen: network management, SDO, emergencies, error control, LSS."""
