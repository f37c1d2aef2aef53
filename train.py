"""Fit one model on one training set and evaluate it: python train.py model=continuum train=sample3."""

from freelearn.commands.app import train_app

if __name__ == "__main__":
    train_app()
