"""Two computers, one run: links that lose and repeat messages, a courier, a watchdog."""
