"""Description of a problem: axes, moves, stops, stages, charges, and its grid."""
