"""python -m freelearn.gather: the results of finished sweeps as a table and heat maps."""

from freelearn.cli.gathering import main

if __name__ == "__main__":
    main()
