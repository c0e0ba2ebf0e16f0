"""Contact of tip and part: phases of a push, traces, free slides, impacts, resonance of stiction."""
