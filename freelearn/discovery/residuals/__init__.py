"""What residuals show: where a model fails, which readings slipped."""
