"""SDO server."""
