"""Logs of runs: labelled tables, a journal on disk, chained by digests, that survives a kill, units."""
