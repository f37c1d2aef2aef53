"""What a session holds, and its work in processes of its own."""
