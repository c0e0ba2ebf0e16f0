"""Ground floor, which knows of no process: fields and checks, units, files, plans, pictures, compiling, faces, executors, random numbers."""
