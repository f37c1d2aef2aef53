"""What is done for each thing that is asked."""
