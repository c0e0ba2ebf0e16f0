"""`Probe` and `Ring`: a measuring head at a turning ring, and its errors."""
