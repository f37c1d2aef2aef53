"""python -m freelearn.figures: the paper's other figures and tables from a sweep's or a run's folder."""

from freelearn.cli.paper_figures import main

if __name__ == "__main__":
    main()
