"""The path of a controller: the stretch of a locus over one coordinate, its inverse and its control law."""
