"""Effects that remember, along the recordings of a log."""
