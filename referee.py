"""Ask whether what a run claims stands: python referee.py run=FOLDER."""

from freelearn.cli.run_commands import referee_app

if __name__ == "__main__":
    referee_app()
