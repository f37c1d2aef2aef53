"""The model that a search begins with, as a step of its own."""

from freelearn.inference.prepare import Prepared, prepare
from freelearn.inference.question import Question
from freelearn.inference.step import Step


def first_step(question: Question) -> tuple[Prepared, Step]:
    """The settled question, and its model with the given effects alone under the noise found about it."""
    prepared, fit, noise = prepare(question)
    return prepared, prepared.step(fit, noise.whitener())
