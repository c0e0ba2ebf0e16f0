"""Doubts: what data say about a problem, what they do not say, and what it costs not to know."""
