"""The same physics written a second time, slowly and plainly, to hold the package against."""
