"""FMI 2.0 for co-simulation: description, shell in C, binary and archive of an FMU."""
