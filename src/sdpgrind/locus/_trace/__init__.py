"""Tracing best points: conditions of Karush, Kuhn and Tucker followed through folds and changes of what is active."""
