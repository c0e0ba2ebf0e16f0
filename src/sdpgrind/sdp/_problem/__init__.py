"""What is asked: axes, moves, stops, stages, charges, and the grid on which they are laid."""
