"""What is learned between parts: safety margins, bounding of constraints, sharpness handed on."""
