"""Modifier adaptation: a controller corrects a structurally wrong model by measured values and slopes."""
