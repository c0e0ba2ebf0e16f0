"""Controllers of a cycle: filter of the part, safe position of the axis; sections as printed, stages."""
