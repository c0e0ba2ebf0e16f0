"""Doubts about centering: what scans and pushes of a part say about its model."""
