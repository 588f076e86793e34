"""The simulated bus for programs that know other adapters only."""
