"""Problem of `sdp`."""
