"""Which rows to measure next: optimal design over what the bed can reach."""
