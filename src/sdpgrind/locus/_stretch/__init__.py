"""The part of a locus for a controller, one active constraint over one coordinate; its control law."""
