"""The whole loop with the mouse: a page on localhost over the same code as the commands."""
