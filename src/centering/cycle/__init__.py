"""The whole centering cycle: which push next, and the controllers that do it."""
