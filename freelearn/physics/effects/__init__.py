"""The library's effects, in folders by the port that they plug into."""
