"""Controller of a whole cycle: measures the part, learns form and friction, chooses push or end."""
