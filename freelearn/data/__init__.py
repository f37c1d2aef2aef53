"""Tables: what a bed imposes and measures, read, checked and held in SI."""
