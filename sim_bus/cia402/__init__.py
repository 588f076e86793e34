"""Drive profile CiA 402 (IEC 61800-7-201) of the simulated drive: states, modes, faults."""
