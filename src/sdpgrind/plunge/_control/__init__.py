"""Controllers of a cycle: estimation during the part, command of the next sample."""
