"""`CenteringMachine`: turning table, pushing tip, ring, gauges, and the tasks of its computer."""
