"""From a state to loads: mechanics, the chain, effects and models."""
