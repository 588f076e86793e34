"""Electronic data sheets (CiA 306)."""
