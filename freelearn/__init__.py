"""freelearn: fit, compare and correct models of fiber-reinforced soft actuators (FREEs).

In Python: `freelearn.load(folder)` takes a fitted model up again, `freelearn.plan(folder, rows=12)` says what to
measure next, `freelearn.referee(folder)` whether what a run claims stands.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from freelearn.package import VERSION

if TYPE_CHECKING:
    from freelearn.commands.plan import plan
    from freelearn.commands.referee import referee
    from freelearn.results.fitted_model import Answer, FittedModel, load

__version__ = VERSION
__all__ = ["Answer", "FittedModel", "__version__", "load", "plan", "referee"]


def __getattr__(name: str) -> Any:
    # Imported when asked for: torch takes seconds, and commands report a mistake before they need it.
    if name in ("Answer", "FittedModel", "load"):
        from freelearn.results import fitted_model

        return getattr(fitted_model, name)
    if name == "plan":
        from freelearn.commands.plan import plan

        return plan
    if name == "referee":
        from freelearn.commands.referee import referee

        return referee
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
