"""What a running robot can be told to do."""
