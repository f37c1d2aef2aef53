"""Which physics a model misses, and whether what is claimed stands."""
