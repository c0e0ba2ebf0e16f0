"""Force table of `plants`."""
