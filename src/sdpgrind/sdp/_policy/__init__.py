"""Policy of `sdp`."""
