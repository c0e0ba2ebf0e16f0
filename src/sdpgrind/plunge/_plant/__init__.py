"""Truth of a part under the wheel, its gauges, and simulated parts under a controller."""
