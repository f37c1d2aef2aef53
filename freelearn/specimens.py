"""python -m freelearn.specimens: fit the rubber to its own tests."""

from freelearn.cli.specimen_fits import main

if __name__ == "__main__":
    main()
