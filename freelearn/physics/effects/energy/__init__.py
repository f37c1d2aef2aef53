"""Effects on the energy of wall and fiber."""
