"""Files of machines and gauges as columns in the library's units, without knowledge of logs."""
