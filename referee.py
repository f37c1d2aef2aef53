"""Ask whether what a run claims stands: python referee.py run=FOLDER."""

from freelearn.commands.referee import referee_app

if __name__ == "__main__":
    referee_app()
