"""Effects on the tube's geometry and ends."""
