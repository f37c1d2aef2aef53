"""What is asked, checked once and frozen."""
