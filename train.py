"""Fit one model on one training set and evaluate it: python train.py model=continuum train=sample3."""

from freelearn.cli.fit_commands import train_app

if __name__ == "__main__":
    train_app()
