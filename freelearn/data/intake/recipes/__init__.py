"""What a recipe says, and the file that it stands in."""
