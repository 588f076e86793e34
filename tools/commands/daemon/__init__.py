"""Commands that start a daemon or talk to one."""
