"""Distances of points from straight lines in space."""

from sdpgrind.base.compiling.compiled import compiled

TOGETHER = 16  # chosen: following lines in one box


@compiled(error_model="numpy")
def _square(line, x, y, z):
    """Squared distance of a point from a line (6,), start and end."""
    dx, dy, dz = line[3] - line[0], line[4] - line[1], line[5] - line[2]
    px, py, pz = x - line[0], y - line[1], z - line[2]
    length = dx * dx + dy * dy + dz * dz
    t = (px * dx + py * dy + pz * dz) / length if length > 0.0 else 0.0
    t = min(max(t, 0.0), 1.0)
    px, py, pz = px - t * dx, py - t * dy, pz - t * dz
    return px * px + py * py + pz * pz


@compiled(error_model="numpy")
def _outside(box, x, y, z):
    """Squared distance of a point from a box (6,), lowest and highest corner."""
    dx = max(box[0] - x, x - box[3], 0.0)
    dy = max(box[1] - y, y - box[4], 0.0)
    dz = max(box[2] - z, z - box[5], 0.0)
    return dx * dx + dy * dy + dz * dz


@compiled(error_model="numpy")
def clear_of(lines, boxes, points, margin, out):
    """Fill `out` (m,): whether points (m, 3) are at least `margin` away from lines (n, 6) in boxes (g, 6).

    Lines in a box that is farther than another line are not asked. A distance changes by no more than the
    point moves: points that follow are asked only when they have moved by what was left.
    """
    rest, at, nearest = -1.0, 0, 0
    for k in range(len(points)):
        x, y, z = points[k, 0], points[k, 1], points[k, 2]
        if rest > 0.0:
            moved = (x - points[at, 0]) ** 2 + (y - points[at, 1]) ** 2 + (z - points[at, 2]) ** 2
            if moved < rest * rest:
                out[k] = out[at]
                continue
        least = _square(lines[nearest], x, y, z)
        for b in range(len(boxes)):
            if _outside(boxes[b], x, y, z) < least:
                for i in range(TOGETHER * b, min(TOGETHER * (b + 1), len(lines))):
                    square = _square(lines[i], x, y, z)
                    if square < least:
                        least, nearest = square, i
        least = least**0.5
        out[k] = least >= margin
        rest, at = abs(least - margin), k
