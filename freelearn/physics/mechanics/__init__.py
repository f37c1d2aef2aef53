"""Thick-walled tubes of rubber and fiber: pure tensors, no files, no settings."""
