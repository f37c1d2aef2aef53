"""Which rows to measure next: python plan.py run=FOLDER rows=12."""

from freelearn.cli.run_commands import plan_app

if __name__ == "__main__":
    plan_app()
