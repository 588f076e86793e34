"""The subcommands; each module adds its own to the command line with `register`."""
