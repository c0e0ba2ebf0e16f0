"""The controller of a whole cycle: looks at the part, learns its form and friction, decides the next push or the end."""
