"""Pages for colleagues: one HTML file from blocks, with pictures, data and digests inside."""
