"""A push that brings a ring to the axis: direction, stroke, where it comes to rest; the saved `Push`."""
