"""Plan of `sdp`."""
