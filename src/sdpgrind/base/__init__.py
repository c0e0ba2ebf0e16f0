"""Ground floor: units, argument checks, random numbers, executors, labelled records."""
