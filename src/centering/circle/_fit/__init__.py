"""Where a ring lies, from a batch of readings: fits of the exact curve, plain, robust and with correlated noise; the limaçon."""
