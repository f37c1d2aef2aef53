"""Models: what each makes of a state, and how they are found by name."""
