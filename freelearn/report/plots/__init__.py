"""Pictures by matplotlib, for files and notebooks."""
