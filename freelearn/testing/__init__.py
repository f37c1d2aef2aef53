"""What a user needs to test an effect or a model of their own, and references that the project tests itself against."""
