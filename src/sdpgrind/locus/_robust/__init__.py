"""A locus for several models that disagree: least mean or worst loss under feedback."""
