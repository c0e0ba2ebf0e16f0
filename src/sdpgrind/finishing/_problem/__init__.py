"""A finishing job and its motion: problem, presets, plan, the saved `Motion`."""
