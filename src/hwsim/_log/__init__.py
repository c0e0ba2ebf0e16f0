"""What was measured and commanded: the log, its journal on disk that survives a kill, labels and units."""
