"""From a laboratory's raw files to a measurement table."""
