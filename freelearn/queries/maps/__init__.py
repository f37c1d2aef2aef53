"""What an actuator reaches, and how stiff it is there."""
