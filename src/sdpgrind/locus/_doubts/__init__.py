"""Doubts about an optimal locus: what measured responses say about the fields of its model."""
