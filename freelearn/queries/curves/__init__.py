"""A model along the pressures of a state, beside what was measured there."""
