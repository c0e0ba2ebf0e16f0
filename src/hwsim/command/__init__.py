"""The command line: what all commands share, and a folder for each area."""
