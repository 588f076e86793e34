"""Model of a cable robot and control of its platform: geometry, tensions, workspace, loops."""
