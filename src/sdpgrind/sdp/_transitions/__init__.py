"""Transitions of `sdp`."""
