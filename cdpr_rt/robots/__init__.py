"""What is particular to each kind of cable robot: its geometry, and how tensions are chosen."""
