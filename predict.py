"""Fill in the blanks of a table with a fitted model: python predict.py run=FOLDER data.path=QUESTIONS.csv."""

from freelearn.cli.run_commands import predict_app

if __name__ == "__main__":
    predict_app()
