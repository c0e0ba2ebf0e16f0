"""Matching of a motion's places with a followed path, without going back."""

from math import sqrt

from sdpgrind.base.compiling.compiled import compiled


@compiled
def nearest_share(nodes, k, place, least):
    """Return the share in [least, 1] of segment k that is nearest to a place, and the distance, mm."""
    along, square = 0.0, 0.0
    for c in range(3):
        step = nodes[k + 1, c] - nodes[k, c]
        along += step * (place[c] - nodes[k, c])
        square += step * step
    share = least
    if square > 0.0:
        share = min(max(along / square, least), 1.0)
    away = 0.0
    for c in range(3):
        gap = place[c] - nodes[k, c] - share * (nodes[k + 1, c] - nodes[k, c])
        away += gap * gap
    return share, sqrt(away)


@compiled
def match(nodes, places, segment, share, away):
    """Match every place (n, 3) with the first nearest point of a path after that of the place before.

    Parameters
    ----------
    nodes : array, (m, 3)
        Corners of the path, mm.
    places : array, (n, 3)
        Places in sequence, mm.
    segment, share, away : array, (n,)
        Filled with segment, share of it and distance, mm.
    """
    k, least = 0, 0.0
    for i in range(len(places)):
        u, d = nearest_share(nodes, k, places[i], least)
        while k + 2 < len(nodes):
            v, further = nearest_share(nodes, k + 1, places[i], 0.0)
            if further < d or (u == 1.0 and further <= d and v > 0.0):
                k, u, d = k + 1, v, further
            else:
                break
        segment[i], share[i], away[i] = k, u, d
        least = u
