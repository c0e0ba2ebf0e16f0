"""A locus that holds for most of many drawn models."""
