"""Pages of logs: worst parts first, planned against realised with reasons, job and digests inside."""
