"""Distributions of `sdp`."""
