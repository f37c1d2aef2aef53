"""The chain from an imposed state to the loads that sensors show, and what plugs into it."""
