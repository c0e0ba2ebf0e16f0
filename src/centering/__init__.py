"""Measuring an off-centre ring while it turns: geometry with its confidence, roundness, what the grinder is told (Mears 2006)."""

__all__: list[str] = []
