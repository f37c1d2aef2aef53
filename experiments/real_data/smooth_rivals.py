"""What smooth functions of pressures, and of more than these, predict of the pose of a free end block."""

from __future__ import annotations

import warnings
from collections.abc import Callable

import numpy as np
import pandas as pd

Array = np.ndarray
# Rows to fit and rows to predict, (N,) bool each → (n, 2) m and rad.
Predict = Callable[[Array, Array], Array]
COMMANDED = ("P1_cmd_Pa", "P2_cmd_Pa", "P3_cmd_Pa")
# The rest of the pose, which no command imposes: sideways [m] and tilts [rad].
ASIDE = ("x_m", "y_m", "rot5_rad", "rot6_rad")
# Levels of each pressure: the third goes up within a sweep of the second, and that within one of the first.
LEVELS = 9


def polynomial_columns(inputs: Array, degree: int) -> Array:
    """A full polynomial: inputs (N, c) → columns (N, p)."""
    x = (inputs - inputs.mean(0)) / inputs.std(0)
    powers = [p for p in np.ndindex(*[degree + 1] * x.shape[1]) if sum(p) <= degree]
    return np.stack([np.prod(x ** np.array(p), axis=1) for p in powers], axis=1)


def least_squares(columns: Array, pose: Array) -> Predict:
    """The linear model of these columns (N, p) for the pose (N, 2)."""

    def predict(fitted: Array, asked: Array) -> Array:
        predicted: Array = columns[asked] @ np.linalg.lstsq(columns[fitted], pose[fitted], rcond=None)[0]
        return predicted

    return predict


def levels(raw: pd.DataFrame) -> Array:
    """The level of each commanded pressure, (N, 3) int."""
    return np.stack([np.unique(raw[name].round(), return_inverse=True)[1] for name in COMMANDED], axis=1)


def more_inputs(raw: pd.DataFrame, pressures: Array) -> dict[str, Array]:
    """The cubic's columns and those of what it does not know: when a step was, what was before, where else the block
    is."""
    cubic, level = polynomial_columns(pressures, 3), levels(raw)
    number = level @ (LEVELS**2, LEVELS, 1)
    time = (number / number.max())[:, None] - 0.5
    # What was commanded one step before: of all steps, those without a pose too.
    before = np.stack(np.unravel_index(np.maximum(number - 1, 0), (LEVELS,) * 3), axis=1) / LEVELS - 0.5
    aside = raw[list(ASIDE)].to_numpy(float)
    aside = (aside - aside.mean(0)) / aside.std(0)
    unit = (pressures - pressures.mean(0)) / pressures.std(0)
    return {
        "the time, its square, and both by each pressure": np.hstack(
            [cubic, time, time**2, time * unit, time**2 * unit]
        ),
        "the pressures commanded before": np.hstack([cubic, before]),
        "its tilts and places sideways": np.hstack([cubic, aside]),
    }


def gaussian_process(inputs: Array, pose: Array) -> Predict:
    """A Gaussian process (Matérn 5/2, a length for each input, white noise) on what a straight line leaves; its
    constants by maximum likelihood on the rows fitted."""
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel

    x = (inputs - inputs.mean(0)) / inputs.std(0)
    straight = np.c_[np.ones(len(x)), x]

    def predict(fitted: Array, asked: Array) -> Array:
        predicted = np.empty((int(asked.sum()), pose.shape[1]))
        for channel, value in enumerate(pose.T):
            slope = np.linalg.lstsq(straight[fitted], value[fitted], rcond=None)[0]
            left = value[fitted] - straight[fitted] @ slope
            kernel = ConstantKernel(1.0) * Matern(np.ones(x.shape[1]), (0.05, 100.0), nu=2.5)
            process = GaussianProcessRegressor(kernel + WhiteKernel(0.05, (1e-4, 1.0)), random_state=0)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", ConvergenceWarning)
                process.fit(x[fitted], left / left.std())
            predicted[:, channel] = straight[asked] @ slope + left.std() * process.predict(x[asked])
        return predicted

    return predict
