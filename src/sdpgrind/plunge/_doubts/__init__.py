"""Doubts about a plunge cycle: what sizes, commands and powers of parts say about its model."""
