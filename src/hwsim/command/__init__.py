"""The command line: common modules, and a folder for each area."""
