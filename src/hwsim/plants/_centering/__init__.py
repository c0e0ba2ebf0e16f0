"""`CenteringMachine`: table, pushing slide, ring, gauges, and the tasks of its computer."""
