"""Master side: CAN buses, CANopen network, CiA 402 axes."""
