"""python -m freelearn.specimens: fit the rubber to its own tests."""

from freelearn.commands.specimens import main

if __name__ == "__main__":
    main()
