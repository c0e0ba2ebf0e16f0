"""The part of a locus that a controller can walk along: single-valued in the measurement, calibrated, with its inverse."""
