"""freelearn: fit, compare and correct models of fiber-reinforced soft actuators (FREEs).

In Python: `freelearn.read_table` checks a table, `freelearn.fit` fits a model to it and `freelearn.discover` says which
effect it misses; `freelearn.load(folder)` takes a fitted model up again, `freelearn.plan(folder, rows=12)` says what to
measure next, `freelearn.referee(folder)` whether what a run claims stands.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from freelearn.package import VERSION

if TYPE_CHECKING:
    from freelearn.api.functions import discover, fit, read_table
    from freelearn.commands.plan import plan
    from freelearn.commands.referee import referee
    from freelearn.errors import UserError
    from freelearn.results.fitted_model import Answer, FittedModel, load
    from freelearn.results.found import Found

__version__ = VERSION
__all__ = [
    "Answer", "FittedModel", "Found", "UserError", "__version__", "discover", "fit", "load", "plan", "read_table",
    "referee",
]  # fmt: skip

# Imported when asked for: torch takes seconds, and commands report a mistake before they need it.
WHERE = {
    "Answer": "results.fitted_model",
    "FittedModel": "results.fitted_model",
    "Found": "results.found",
    "UserError": "errors",
    "discover": "api.functions",
    "fit": "api.functions",
    "load": "results.fitted_model",
    "plan": "commands.plan",
    "read_table": "api.functions",
    "referee": "commands.referee",
}


def __getattr__(name: str) -> Any:
    if name not in WHERE:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"freelearn.{WHERE[name]}"), name)
