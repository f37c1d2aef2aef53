"""Does a claim stand? Checks of a model that are independent of how it was found."""
