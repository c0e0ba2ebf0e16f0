"""Tool paths over a surface: patterns, maps onto the surface, arc length, contact frames, what a path is worth."""
