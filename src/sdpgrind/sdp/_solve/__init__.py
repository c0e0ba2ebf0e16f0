"""Solve of `sdp`."""
