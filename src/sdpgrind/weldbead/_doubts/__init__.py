"""Doubts about a weld bead: what powers, forces and depths of passes say about its process."""
