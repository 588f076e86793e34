"""A robot's drives put together from its file: buses, boot, devices beside them, the machine."""
