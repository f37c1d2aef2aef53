"""`fit`, and the same fit still to be made, as scikit-learn knows estimators."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import pandas as pd

from freelearn.api.arguments import Group, StatedAccuracy, options_of, settings_of
from freelearn.api.session_folders import new_folder
from freelearn.api.settings.settings import TrainSettings
from freelearn.api.table_files import Members, Table, said_of, table_file
from freelearn.common.errors import UserError

if TYPE_CHECKING:
    from freelearn.api.fitted_run import FittedRun
    from freelearn.queries.fitted_model import Answer


def fit(
    table: Table,
    model: Group = "continuum",
    *,
    effects: Sequence[str] = (),
    train: str | Sequence[str] = "all",
    test: str = "every",
    fit: Group = "levenberg_marquardt",
    split: Group = "rows",
    accuracy: StatedAccuracy = None,
    bed: str | None = None,
    members: Members | None = None,
    design: Mapping[str, float] | None = None,
    recipe: str | Path | None = None,
    data: Mapping[str, Any] | None = None,
    fix: Sequence[str] | Mapping[str, float] = (),
    bounds: Mapping[str, tuple[float, float]] | None = None,
    priors: bool | Mapping[str, tuple[float, float]] = True,
    material: str | None = None,
    per_sample: bool = True,
    constituent: str | Path | None = None,
    fits: str | Path | None = None,
    seed: int = 0,
    device: Literal["cpu", "cuda", "auto"] = "cpu",
    figures: bool = False,
    bands: bool = True,
    folder: str | Path | None = None,
    progress: bool = True,
    **options: Any,
) -> FittedRun:
    """A model fitted to a measurement table, as `freelearn train` does it, bit for bit.

    table: a DataFrame in the measurement table's columns, a file, or a data set of the package (dmsp20, virtual).
    model: continuum, linear, mlp, hybrid or one of your own; with options of its own {"name": "continuum", "C1": 2e5}.
    effects: names of those that the model has. train, test: the sets that are fitted and scored: all, sampleN,
    withoutN, even, a list of names; test: every.
    fit: levenberg_marquardt, an optimizer (adam, …) or none; {"intervals": "profile"} sets options of it. split: rows
    or states, which are held out whole.
    accuracy: `fl.Accuracy(force_n=0.1)`, the same as a mapping, or "estimate". bed, members, design, recipe: as of
    `read_table`. data: further options of a data set, such as {"hidden": ["end_clamps"]} of the virtual one.
    fix: names of parameters that are held, or their values by name, SI. bounds: (lowest, highest) by name, SI. priors:
    (mean, standard deviation) by name, SI; False: general knowledge counts for nothing. material: what the wall is made
    of. per_sample: whether each sample has its own value of what building or mounting sets.
    constituent: a specimen.json for train="constituent". fits: a folder in which finished fits are kept and found
    again. seed: the same gives the same numbers. device: cpu, cuda or auto. figures: whether the command's pictures are
    written. bands: whether its curves have 95 % bands.
    folder: where the run's files go; by default they are this session's, see `save`. progress: whether a terminal or a
    notebook shows how far it is. options: nested ones by their names, {"fit.tolerance": 1e-6}.
    Raises UserError with every mistake.

    >>> import freelearn as fl
    >>> run = fl.fit("dmsp20", effects=["fiber_misalignment"], fix={"C1": 3e5}, progress=False)
    >>> sorted(run.parameters)
    ['C1', 'C2', 'fiber_misalignment.angle']
    """
    arguments = options_of(locals())
    where = new_folder("fit") if folder is None else Path(folder)
    with ExitStack() as stack:
        place = table_file(table, None if folder is None else where, design, recipe, members, bed)
        stack.enter_context(said_of(place))
        settings = settings_of(TrainSettings, "train", place, arguments)
        # After the settings are checked: torch takes seconds to import.
        from freelearn.api.fitted_run import FittedRun
        from freelearn.api.shown_progress import Shown
        from freelearn.api.tasks.train_task import train as run

        shown = stack.enter_context(Shown("fitting", progress))
        run(settings, where, progress=shown.epochs(settings.fit))
    return FittedRun.from_folder(where, Estimator(**arguments, design=design, recipe=recipe, progress=progress))


class Estimator:
    """The options of `fit`, without a table. What scikit-learn does with estimators works: `clone`, `cross_val_score`
    with a table in the place of X, `GridSearchCV`.

    >>> from sklearn.base import clone
    >>> clone(Estimator(model="linear", seed=1)).get_params()
    {'model': 'linear', 'seed': 1}
    """

    def __init__(self, **options: Any) -> None:
        self.options = options
        self.run_: FittedRun | None = None

    def get_params(self, deep: bool = True) -> dict[str, Any]:
        """The options. deep: of scikit-learn, without meaning here."""
        return dict(self.options)

    def set_params(self, **options: Any) -> Estimator:
        """Sets options."""
        self.options = self.options | options
        return self

    def fit(self, table: pd.DataFrame, y: object = None) -> Estimator:
        """Fits the model to a table. y: of scikit-learn, without meaning here: a table holds what was measured."""
        self.run_ = fit(table, **self.options)
        return self

    def predict(self, table: pd.DataFrame) -> Answer:
        """What the fitted model predicts, see FittedRun.predict."""
        return self._run.predict(table)

    def score(self, table: pd.DataFrame, y: object = None) -> float:
        """−E on a table's rows: of two the better is the larger."""
        return self._run.score(table)

    @property
    def _run(self) -> FittedRun:
        if self.run_ is None:
            raise UserError("Nothing is fitted yet: call fit(table) first.")
        return self.run_

    def __repr__(self) -> str:
        return f"Estimator({', '.join(f'{name}={value!r}' for name, value in self.options.items())})"

    def __sklearn_tags__(self) -> Any:
        """What scikit-learn asks of an estimator."""
        from sklearn.utils import InputTags, Tags, TargetTags

        return Tags("regressor", TargetTags(required=False), input_tags=InputTags(two_d_array=True))
