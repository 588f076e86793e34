"""Model of a robot's platform: geometry, statics, workspace."""
