"""The traced `Locus` of one hidden state and `Area` of several: tables, inversion, files, pictures."""
