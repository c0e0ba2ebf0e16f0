"""Controllers of a cycle, sample by sample: what they estimate during a part, and parts followed to their end, compiled."""
