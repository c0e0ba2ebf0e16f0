"""The fastest cycle without burned layers: exact, by dynamic programming, by collocation; as a program."""
