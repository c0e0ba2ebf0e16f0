"""What every area uses: declared fields, checks, units, files, plans, pictures, compiling, executors."""
