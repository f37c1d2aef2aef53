"""freelearn: fit, compare and correct models of fiber-reinforced soft actuators (FREEs).

    import freelearn as fl

`fl.read_table` checks a table, `fl.fit` fits a model to it and `fl.discover` says which effect it misses;
`fl.plan(found, rows=12)` says what to measure next, `fl.referee(found)` whether what is claimed stands,
`fl.load(folder)` takes a run up again. `fl.Accuracy` states how accurate the bed is; a mistake is an `fl.UserError`.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from freelearn.common.package import VERSION

if TYPE_CHECKING:
    from freelearn.api.actuators import actuators
    from freelearn.api.estimator import Estimator, fit
    from freelearn.api.fitted_run import FittedRun
    from freelearn.api.found import Found
    from freelearn.api.functions import discover, load, plan, referee
    from freelearn.api.stated_accuracy import Accuracy
    from freelearn.api.table_files import read_table
    from freelearn.common.errors import UserError
    from freelearn.queries.answers import Answers
    from freelearn.queries.fitted_model import Answer, FittedModel

__version__ = VERSION
__all__ = [
    "Accuracy", "Answer", "Answers", "Estimator", "FittedModel", "FittedRun", "Found", "UserError", "__version__",
    "actuators", "discover", "fit", "load", "plan", "read_table", "referee",
]  # fmt: skip

# Imported when asked for: torch takes seconds, and a mistake is told before it is needed.
WHERE = {
    "Accuracy": "api.stated_accuracy",
    "Answer": "queries.fitted_model",
    "Answers": "queries.answers",
    "Estimator": "api.estimator",
    "FittedModel": "queries.fitted_model",
    "FittedRun": "api.fitted_run",
    "Found": "api.found",
    "UserError": "common.errors",
    "actuators": "api.actuators",
    "discover": "api.functions",
    "fit": "api.estimator",
    "load": "api.functions",
    "plan": "api.functions",
    "read_table": "api.table_files",
    "referee": "api.functions",
}


def __getattr__(name: str) -> Any:
    if name not in WHERE:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"freelearn.{WHERE[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
