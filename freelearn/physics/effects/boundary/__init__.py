"""Effects on the state that is really imposed."""
