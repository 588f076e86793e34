"""A robot's drives, assembled from its file: buses, boot, additional devices, the machine."""
