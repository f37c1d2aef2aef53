"""A laboratory's raw file as a measurement table: python intake.py data.path=RAW recipe=RECIPE.yaml."""

from freelearn.cli.run_commands import intake_app

if __name__ == "__main__":
    intake_app()
