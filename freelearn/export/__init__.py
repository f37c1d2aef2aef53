"""A fitted actuator as arithmetic for other software, with its certificate."""
