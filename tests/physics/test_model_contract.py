"""The contract of freelearn.testing.models for every model of the library, and for a user's own."""

from braided import BraidedMuscle

from freelearn.physics.models.continuum import (
    Continuum,
    ContinuumInextensible,
    ContinuumLinearMaterial,
    ContinuumThinWall,
)
from freelearn.physics.models.linear import Linear
from freelearn.physics.models.mlp import MLP
from freelearn.testing.effects import TRUTH
from freelearn.testing.models import ModelContract


class TestContinuum(ModelContract):
    model = Continuum
    values = TRUTH["continuum"]


class TestLinearMaterial(TestContinuum):
    model = ContinuumLinearMaterial


class TestThinWall(TestContinuum):
    model = ContinuumThinWall


class TestInextensible(ModelContract):
    model = ContinuumInextensible
    values = {"C1": 1e6}  # noqa: RUF012


class TestLinear(ModelContract):
    model = Linear
    values = TRUTH["linear"]


class TestNetwork(ModelContract):
    model = MLP


class TestBraidedMuscle(ModelContract):
    model = BraidedMuscle
