"""What every area uses: declared fields, checks, units, files with digests, pages, pictures, compiling."""
