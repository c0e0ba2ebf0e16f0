"""Doubts about finishing: what roughness of parts and motion of the torque axis say about their models."""
