"""Roundness of what was measured: profile, reference circles, filters, the runout of the roller."""
