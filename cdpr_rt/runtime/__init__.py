"""The control loop as a service: what it shares with other processes, and how it behaves."""
