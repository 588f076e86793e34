"""The benches of buses and cycles: what exchanges cost, and when they come."""
