"""Time laws: how fast a run is played within the limits of its joints."""
