"""Diagnosis of a robot's file: feasibility, loop, turning, cable loss."""
