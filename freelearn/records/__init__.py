"""What a run, a sweep or a search found: values and files, written and read back."""
