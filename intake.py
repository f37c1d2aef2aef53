"""A laboratory's raw file as a measurement table: python intake.py data.path=RAW recipe=RECIPE.yaml."""

from freelearn.cli.intake_command import intake_app

if __name__ == "__main__":
    intake_app()
