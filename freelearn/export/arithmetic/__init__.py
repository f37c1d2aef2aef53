"""A model's one row as a graph of numbers."""
