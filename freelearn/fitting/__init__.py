"""Fitting a model to rows, and how well the fit knows its parameters."""
