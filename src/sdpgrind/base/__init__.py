"""Ground floor, which knows of no process: fields, checks, units; files, plans, pictures; compiling, faces, executors."""
