"""What is kept of a robot from one run to the next: lengths, and which geometry is in force."""
