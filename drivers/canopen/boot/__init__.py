"""Boot of CANopen nodes (CiA 302-2) and their configuration."""
