"""Tracing of optima: KKT conditions, continued through changes of the active set up to folds."""
