"""`AdaptiveGrinder`: a process whose limit drifts while it is kept at its best point."""
