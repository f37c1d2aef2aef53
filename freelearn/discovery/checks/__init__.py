"""A look at the table as an engineer would look, before any search."""
