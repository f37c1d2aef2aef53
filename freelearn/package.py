"""The package itself: where it lies and which version it is."""

from pathlib import Path

FOLDER = Path(__file__).resolve().parent
VERSION = "0.2.0"
