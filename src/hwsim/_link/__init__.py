"""A machine and its host on two computers: links that lose messages, a courier, a watchdog."""
