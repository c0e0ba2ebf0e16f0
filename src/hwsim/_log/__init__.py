"""Logs of runs: labelled tables, a journal on disk that survives a kill, names and units."""
