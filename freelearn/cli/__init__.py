"""The commands: words of a shell to settings, the face, files and a terminal."""
