"""Measurement tables and their faults."""
