"""How a bed scatters, and whether anything systematic is left."""
