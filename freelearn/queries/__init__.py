"""What a fitted model answers: loads, places, pressures, curves, maps, and what to measure next."""
