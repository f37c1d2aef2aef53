"""What a file seems to hold, what it leaves open, and the recipe that is drafted of both."""
