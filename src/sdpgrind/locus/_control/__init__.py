"""Controllers that walk along a locus by one measurement, one by one and in batches."""
