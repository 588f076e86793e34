"""Model of the operator who teleoperates."""
