"""Designed experiments: orthogonal arrays, signal-to-noise ratios, analysis of variance, what to run next."""
