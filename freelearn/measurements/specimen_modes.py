"""What the homogeneous tests of a rubber specimen are called."""

# Name of each mode, and its short form in tables and commands.
MODE_NAMES = {"uniaxial": "UT", "equibiaxial": "ET", "pure_shear": "PS"}


def mode_name(text: str) -> str | None:
    """The name of the mode that a table or a command calls `text` (uniaxial, Pure shear, UT, …), None if unknown."""
    plain = text.strip().lower().replace(" ", "_").replace("-", "_")
    return next((name for name, short in MODE_NAMES.items() if plain in (name, short.lower())), None)
