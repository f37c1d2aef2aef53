"""What settings say of parameters beforehand."""

from __future__ import annotations

from freelearn.api.settings.settings import DiscoverSettings, Settings
from freelearn.errors import UserError, unknown
from freelearn.fitting.options import LEVENBERG_MARQUARDT, NORMAL, PROFILE
from freelearn.models.base import Model
from freelearn.models.build import MODELS, build_model
from freelearn.models.known import Known
from freelearn.models.stated import stated


def own_values(settings: Settings) -> dict[str, float]:
    """Values of the model's own parameters, SI, by name."""
    return {name: value for name, value in settings.model.values.items() if "." not in name}


def known_of(settings: Settings) -> Known:
    """What is known of the parameters. Raises UserError."""
    chosen = settings.model
    known = stated(
        chosen.name,
        settings.effects,
        chosen.values,
        chosen.errors,
        settings.fix,
        settings.bounds,
        settings.material,
        settings.priors,
        tried=isinstance(settings, DiscoverSettings),
    )
    fit = settings.fit
    if known.priors and fit and (fit.name != LEVENBERG_MARQUARDT or fit.intervals == PROFILE):
        raise UserError(
            f"{', '.join(known.priors)} with an error needs fit={LEVENBERG_MARQUARDT} and intervals={NORMAL}, as other "
            "fits and profiles do not heed it: choose these, or fix the value."
        )
    return known


def known_model(settings: Settings) -> Model:
    """The model with its effects and what is known of it, before there are data. Raises UserError."""
    name = settings.model.name
    known = known_of(settings) if name in MODELS else None
    return build_model(name, own_values(settings), settings.effects, known=known)


def check_numbers(known: Known, model: Model) -> None:
    """Whether each sample or member named by its number, as in length_offset.length[3], is there. Raises UserError."""
    for label in dict.fromkeys([*known.starts, *known.fixed, *known.bounds, *known.priors]):
        own = [name for name in model.declared if name.split("[")[0] == label.split("[")[0]]
        if "[" in label and own and label not in model.declared:
            raise unknown("parameter", label, own)
