"""The model that a search begins with, as a step of its own."""

from freelearn.discovery.fits.prepare import Prepared, Question, prepare
from freelearn.discovery.fits.step import Step


def first_step(question: Question) -> tuple[Prepared, Step]:
    """The settled question, and its model with the given effects alone under the noise found about it."""
    prepared, fit, noise = prepare(question)
    return prepared, prepared.step(fit, noise.whitener())
