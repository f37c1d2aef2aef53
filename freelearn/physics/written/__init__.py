"""Effects that are written down by the program itself, from a place in the chain, its inputs and a closed form."""
