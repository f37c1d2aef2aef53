"""What is shown of results, as tables, sentences and numbers."""
