"""What a control learns of motors that were not commissioned: friction, cogging, constants."""
