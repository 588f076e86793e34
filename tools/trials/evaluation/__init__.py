"""What a trial has recorded, its figures and its pictures."""
