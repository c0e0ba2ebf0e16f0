"""All three tiers in one: the sequence demands a depth, a pass turns it into forces, a force loop follows."""
