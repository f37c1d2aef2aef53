"""The package itself: where it lies, with what, and which version it is."""

from pathlib import Path

FOLDER = Path(__file__).resolve().parent
VERSION = "0.2.0"
# In an installed package the configuration files lie inside it, in a checkout beside it.
CONF = next((path for path in (FOLDER / "conf", FOLDER.parent / "conf") if path.is_dir()), FOLDER / "conf")
# A path that begins like this is that of a measured example in the package.
EXAMPLE, EXAMPLES = "example:", FOLDER / "examples"


def example(text: str) -> Path:
    """Where a table lies: at a path, or among the package's examples."""
    return EXAMPLES / text.removeprefix(EXAMPLE) if text.startswith(EXAMPLE) else Path(text)
