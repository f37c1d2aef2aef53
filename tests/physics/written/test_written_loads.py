"""What written effects do to the loads, against closed forms by hand in NumPy and against differences."""

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from written_samples import (
    AMOUNTS,
    ENERGIES_BY_HAND,
    PLACE,
    SCALES,
    amounts,
    forms_at,
    inputs_at,
    loads,
    middle,
    model_with,
    named,
    states_of,
    terms_by_hand,
    wrote,
)

from freelearn.physics.chain.material import Material
from freelearn.physics.chain.ports import EnergyEffect
from freelearn.physics.models.build import build_model
from freelearn.physics.written.forms import ENERGIES, ONE, TWO
from freelearn.physics.written.places import PLACES
from freelearn.physics.written.source import effect_class
from freelearn.testing.contract_checks import parameter_derivatives, reciprocal, state_derivatives
from freelearn.testing.effects import TRUTH, EffectContract

RIGID = Material(C1=torch.tensor(1e6).double(), C2=torch.tensor(4e7).double())
# A form of one and a form of two inputs at every place: smooth, with a shape, of several terms.
AT_EVERY_PLACE = [
    (place.name, " ".join(i.name for i in inputs), form)
    for place in PLACES
    for inputs in list(inputs_at(place))[:: 1 if place.potential else 7]
    for form in (
        ("fourth_power", "square_hinge")
        if place.energy
        else ("linear_and_cube", "bump")
        if len(inputs) == 1
        else ("wave_times_linear",)
    )
]


def bare():
    return build_model("continuum", TRUTH["continuum"])


def own(written, values=None):
    """The effect's parameters as tensors: at its starts, or with other values."""
    given_values = {c.name: c.start for c in written.constants()} | (values or {})
    kind = effect_class(written)
    return kind, kind.parameter_class(**{n: torch.tensor(v, dtype=torch.float64) for n, v in given_values.items()})


def read(name: str, states, shown=None) -> np.ndarray:
    """An input by hand, SI."""
    return {
        "elongation": lambda: (states.length - states.reference_length).numpy(),
        "twist": lambda: states.twist.numpy(),
        "pressure": lambda: states.pressure.numpy(),
        "force": lambda: shown[:, 0],
        "moment": lambda: shown[:, 1],
        "time": lambda: states.clock.numpy(),
        "severity": lambda: states.severity.numpy(),
    }[name]()


def by_hand(written, states, shown=None) -> np.ndarray:
    """What the function adds, SI, by the forms in written_samples."""
    scaled = [read(i.name, states, shown) / SCALES[i.name] for i in written.inputs]
    terms = terms_by_hand(written.form, scaled, middle(written.form))
    return sum(a * t for a, t in zip(amounts(written.place, written.form).values(), terms, strict=True))


# --- forms ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("forms", [ONE, TWO], ids=["one", "two"])
def test_the_scans_and_the_files_evaluation_of_a_form_are_the_one_by_hand(forms):
    """The scan has numbers in units of scales, the file SI; both the NumPy of written_samples."""
    states = states_of(8)
    place = PLACE["measurement moment"]
    inputs = tuple(i for i in place.inputs if i.name in ("elongation", "twist"))[: forms[0].inputs]
    scaled = [read(i.name, states) / SCALES[i.name] for i in inputs]
    for form in forms:
        shapes = middle(form)
        expected = terms_by_hand(form, scaled, shapes)
        found = form.values([torch.as_tensor(x) for x in scaled], shapes)
        for term, right in zip(found, expected, strict=True):
            np.testing.assert_allclose(term.numpy(), right, rtol=1e-5, atol=1e-9, err_msg=form.word)
        written = wrote(place, inputs, form)
        kind, p = own(written)
        shown = kind().sense(torch.zeros(len(states), 2).double(), states, p).numpy()
        scan = sum(a * t.numpy() for a, t in zip(amounts(place, form).values(), found, strict=True))
        np.testing.assert_allclose(shown[:, 1], scan, rtol=1e-9, atol=1e-15, err_msg=form.word)
        assert not shown[:, 0].any()


@settings(max_examples=60, deadline=None)
@given(form=st.sampled_from(ONE + TWO), x=st.floats(-1, 1), y=st.floats(-1, 1), data=st.data())
def test_wherever_its_shapes_lie_a_form_is_finite_and_so_are_its_slopes(form, x, y, data):
    """Within the bounds that a fit keeps to; by the inputs and by the shapes."""
    values = [data.draw(st.floats(s.lower, s.upper), label=s.name) for s in form.shapes]
    inputs = torch.tensor([x, y][: form.inputs], dtype=torch.float64, requires_grad=True)
    shapes = torch.tensor(values, dtype=torch.float64, requires_grad=True)
    named_shapes = dict(zip((s.name for s in form.shapes), shapes, strict=True))
    for term in form.values(list(inputs), named_shapes):
        assert term.isfinite()
        for slope in torch.autograd.grad(term, [inputs, shapes], retain_graph=True, allow_unused=True):
            assert slope is None or slope.isfinite().all()


# --- places -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("place", "inputs", "form"), AT_EVERY_PLACE)
def test_with_no_amount_the_loads_are_the_bare_models(place, inputs, form):
    states = states_of()
    without = loads(bare(), states)
    np.testing.assert_allclose(
        loads(model_with(named(place, inputs, form), on=False), states), without, rtol=1e-12, atol=1e-13
    )


SHIFTED = {
    "boundary length": ("length",),
    "boundary twist": ("twist",),
    "boundary pressure": ("pressure",),
    "geometry fiber_angle": ("fiber_angle",),
    "geometry outer_radius": ("outer_radius",),
    "geometry reference_length": ("reference_length",),
    "geometry active_length": ("reference_length", "length"),
}


@pytest.mark.parametrize("form", ["square", "wave", "linear_times_square", "power_times_linear"])
@pytest.mark.parametrize("place", SHIFTED)
def test_a_state_or_a_design_that_is_off_gives_the_loads_of_the_one_that_is_right(place, form):
    states = states_of()
    inputs = "twist pressure" if "_times_" in form else "pressure"
    written = named(place, inputs, form)
    off = torch.as_tensor(by_hand(written, states))
    assert float(off.abs().max()) > 0.1 * abs(AMOUNTS[place])
    right = states.replace(**{name: getattr(states, name) + off for name in SHIFTED[place]})
    np.testing.assert_allclose(loads(model_with(written), states), loads(bare(), right), rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize(("place", "column"), [("boundary length", 0), ("boundary twist", 1)])
def test_a_mount_that_the_loads_bend_is_where_the_loads_it_carries_put_it(place, column):
    """The state imposed is the table's and what the loads shown make of it: a loop, checked from its end."""
    states = states_of()
    name = ("force", "moment")[column]
    written = named(place, name, "odd_square")
    shown = loads(model_with(written), states)
    field = SHIFTED[place][0]
    moved = states.replace(**{field: getattr(states, field) + torch.as_tensor(by_hand(written, states, shown))})
    np.testing.assert_allclose(shown, loads(bare(), moved), rtol=1e-7, atol=1e-8)
    assert np.abs(shown - loads(bare(), states)).max() > 1e-3


ADDED = [
    ("measurement force", "force", "linear_and_square", 0),
    ("measurement force", "moment", "bump", 0),
    ("measurement force", "twist time", "hinge_times_linear", 0),
    ("measurement moment", "moment", "vee", 1),
    ("measurement moment", "time", "step", 1),
    ("parallel axial", "elongation", "hinge", 0),
    ("parallel torsional", "twist", "sine", 1),
    ("parallel torsional", "twist pressure", "exponential_times_linear", 1),
    ("dissipation force", "pressure", "cube", 0),
    ("dissipation moment", "twist moment", "modulus_times_modulus", 1),
]


@pytest.mark.parametrize("family", ["continuum", "linear"])
@pytest.mark.parametrize(("place", "inputs", "form", "column"), ADDED)
def test_what_is_added_to_the_loads_is_the_function_by_hand(place, inputs, form, column, family):
    states = states_of()
    written = named(place, inputs, form)
    before = loads(build_model(family, TRUTH[family]), states)
    more = loads(model_with(written, family=family), states) - before
    expected = by_hand(written, states, before)
    if place.startswith("dissipation"):
        expected = -states.direction.numpy() * expected
    np.testing.assert_allclose(more[:, column], expected, rtol=1e-7, atol=1e-10)
    assert np.abs(expected).max() > 0
    np.testing.assert_allclose(more[:, 1 - column], 0, atol=1e-12)


def test_a_wall_that_fades_takes_its_share_off_the_walls_loads_alone():
    """At no pressure the loads are the wall's, all of them."""
    states = states_of()
    unpressed = states.replace(pressure=torch.zeros_like(states.pressure))
    written = named("dissipation wall", "time", "linear")
    share = by_hand(written, states)
    assert -0.5 < share.min() < -0.01
    np.testing.assert_allclose(
        loads(model_with(written), unpressed), (1 + share)[:, None] * loads(bare(), unpressed), rtol=1e-8, atol=1e-9
    )


# --- potentials and energies ------------------------------------------------------------------------------------------

SMOOTH = ("linear_times_square", "sine_times_linear", "wave_times_square", "bump_times_linear")


@pytest.mark.parametrize("form", SMOOTH)
def test_an_element_of_a_potential_keeps_reciprocity(form):
    """∂F/∂φ = ∂M/∂l at fixed pressure."""
    model = model_with(named("parallel both", "elongation twist", form))
    reciprocal(model, states_of(4))


@pytest.mark.parametrize("form", TWO, ids=lambda f: f"{f.word}-{f.turned}")
def test_the_loads_of_a_potential_are_its_slopes(form):
    """By central differences of the potential by hand."""
    states = states_of(6)
    place = PLACE["parallel both"]
    written = wrote(place, place.inputs, form)
    kind, p = own(written)
    nothing = torch.zeros(len(states), 2).double()
    found = kind().dissipate(nothing, states, p).numpy()
    for column, (field, step) in enumerate((("length", 1e-8), ("twist", 1e-6))):
        ends = [by_hand(written, states.replace(**{field: getattr(states, field) + h})) for h in (step, -step)]
        slope = (ends[0] - ends[1]) / (2 * step)
        scale = np.abs(slope).max()
        np.testing.assert_allclose(found[:, column], -slope, rtol=1e-5, atol=1e-5 * scale + 1e-12)


@pytest.mark.parametrize("form", ENERGIES, ids=lambda f: f.word)
@pytest.mark.parametrize("invariant", ["i1", "i2", "i4"])
def test_an_energy_is_the_one_by_hand_and_its_slope_is_that_of_differences(form, invariant):
    place = PLACE[f"energy {invariant}"]
    written = wrote(place, place.inputs, form)
    kind, p = own(written)
    assert kind.depends_on == (invariant,)
    rest = {"i1": 3.0, "i2": 3.0, "i4": 1.0}[invariant]
    # Between the knees' edges; an invariant of the fibers alone falls below its value at rest.
    over = np.linspace(-0.93 if invariant == "i4" else 0.01, 0.97, 24)
    at = torch.as_tensor(rest + SCALES[invariant] * over)
    found = kind().psi(at, p=p, material=RIGID)
    terms = ENERGIES_BY_HAND[form.word](over, middle(form))
    expected = sum(a * t for a, t in zip(amounts(place, form).values(), terms, strict=True))
    np.testing.assert_allclose(found.numpy(), expected, rtol=1e-9, atol=1e-9)
    (slope,) = kind().psi_gradient(at, p=p, material=RIGID)
    h = 1e-7
    up, down = (kind().psi(at + s * h, p=p, material=RIGID) for s in (1, -1))
    difference = ((up - down) / (2 * h)).numpy()
    np.testing.assert_allclose(slope.numpy(), difference, rtol=1e-5, atol=1e-5 * np.abs(difference).max())


@pytest.mark.parametrize("form", ["cube", "exponential"])
@pytest.mark.parametrize("invariant", ["i1", "i2", "i4"])
def test_with_an_energy_the_loads_keep_reciprocity_and_their_derivatives(invariant, form):
    model = model_with(named(f"energy {invariant}", invariant, form))
    states = states_of()
    reciprocal(model, states)
    state_derivatives(model, states)
    (name,) = [effect.name for effect in model.effects if isinstance(effect, EnergyEffect)]
    parameter_derivatives(model, states, {f"{name}.amount": 10.0})


def test_a_yeoh_wall_written_is_the_librarys():
    """C20 (I₁ − 3)² is wall_stiffening."""
    states = states_of()
    library = build_model("continuum", TRUTH["continuum"] | {"wall_stiffening.C20": 2e5}, ["wall_stiffening"])
    i1 = PLACE["energy i1"]
    square = next(f for f in ENERGIES if f.word == "square")
    written = wrote(i1, i1.inputs, square, {"amount": 2e5 * SCALES["i1"] ** 2})
    np.testing.assert_allclose(loads(model_with(written), states), loads(library, states), rtol=1e-9, atol=1e-10)


# --- one value for each actuator of a block ---------------------------------------------------------------------------


def test_on_an_end_block_every_actuator_has_amounts_of_its_own_and_shares_the_shapes():
    place = PLACE["boundary pressure"]
    form = next(f for f in forms_at(place, (place.inputs[2],)) if f.word == "hinge")
    written = wrote(place, (place.inputs[2],), form, each=True)
    effect = effect_class(written)(members=3)
    name = written.name
    assert set(effect.declared()) == {*(f"{name}.amount[{n}]" for n in (1, 2, 3)), f"{name}.knee"}
    alone = effect_class(written)()
    assert set(alone.declared()) == {f"{name}.amount", f"{name}.knee"}


# --- what every effect must keep --------------------------------------------------------------------------------------


class Kept(EffectContract):
    """Without the other units: the numbers that inputs count in are SI, in the file."""

    test_the_physics_does_not_depend_on_the_units = None  # type: ignore[assignment]
    # Each takes a second or more: with others of the library they are told apart by the search's own tests.
    test_joins_every_other_effect = None  # type: ignore[assignment]


class TestWrittenTwist(Kept):
    effect = effect_class(named("boundary twist", "pressure", "saturation"))


class TestWrittenMount(Kept):
    effect = effect_class(named("boundary length", "force", "cube"))
    family = "continuum"


class TestWrittenRadius(Kept):
    effect = effect_class(named("geometry outer_radius", "pressure", "power"))


class TestWrittenEnergy(Kept):
    effect = effect_class(named("energy i2", "i2", "fourth_power"))


class TestWrittenPotential(Kept):
    effect = effect_class(named("parallel both", "elongation twist", "linear_times_square"))


class TestWrittenWall(Kept):
    effect = effect_class(named("dissipation wall", "time", "saturation"))
    family = "continuum"


class TestWrittenFriction(Kept):
    effect = effect_class(named("dissipation moment", "moment", "cube"))


class TestWrittenCell(Kept):
    # The linear model's forces are a tenth of those that the amount is for.
    effect = effect_class(named("measurement force", "pressure force", "linear_times_square"))
    family = "continuum"
