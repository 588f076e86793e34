"""What the loop can be told to do, by name: a set-point over time and who follows it."""
