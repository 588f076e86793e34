"""Set-point streams over UDP."""
