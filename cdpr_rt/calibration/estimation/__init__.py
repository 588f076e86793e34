"""The least-squares fit: parameters, residuals, and readings that contradict it."""
