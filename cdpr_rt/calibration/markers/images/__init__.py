"""What images show of markers."""
