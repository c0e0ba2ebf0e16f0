"""All three tiers in one: the sequence asks for a depth, passes make forces of it, a force loop follows them."""
