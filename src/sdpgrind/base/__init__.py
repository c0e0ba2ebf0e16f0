"""Ground floor: units, argument checks, random numbers, executors, dataclasses as JSON, labelled records."""
