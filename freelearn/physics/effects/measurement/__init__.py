"""Effects on what the sensors show."""
