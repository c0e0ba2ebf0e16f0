"""Slow twin of the matching of places with a path."""

import numpy as np


def match(nodes, places):
    """Segment, share and distance of every place: the first local minimum after the place before."""
    found, k, least = [], 0, 0.0
    for place in places:
        here = _nearest(nodes, k, place, least)
        while k + 2 < len(nodes):
            there = _nearest(nodes, k + 1, place, 0.0)
            passed = here[0] == 1.0 and there[1] <= here[1] and there[0] > 0.0
            if not (there[1] < here[1] or passed):
                break
            k, here = k + 1, there
        least = here[0]
        found.append((k, *here))
    return np.array(found)


def _nearest(nodes, k, place, least):
    step = nodes[k + 1] - nodes[k]
    share = min(max((place - nodes[k]) @ step / (step @ step), least), 1.0) if step @ step else least
    return share, np.linalg.norm(place - nodes[k] - share * step)
