"""Where a model fails and which effect is missing: python discover.py model=continuum data=csv data.path=mine.csv."""

from freelearn.cli.fit_commands import discover_app

if __name__ == "__main__":
    discover_app()
