"""Effects of which loads depend on what went before."""
