"""Controllers that move along a locus by measured responses, singly and in batches."""
