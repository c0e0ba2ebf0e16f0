"""Push that brings a ring to the axis: direction, stroke, final position; the saved `Push`."""
