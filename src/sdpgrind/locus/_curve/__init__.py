"""The traced locus: `Locus` of one hidden state, `Area` of several; tables, inversion, saved files."""
