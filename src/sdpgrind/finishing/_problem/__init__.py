"""The finishing problem, its presets and its plan, a `Motion`."""
