"""The texts of written effects at every place: names, formulas, bounds, and files that load like one's own."""

import ast
import re
import subprocess
import sys
from itertools import product

import numpy as np
import pytest
import torch
from written_samples import ENERGY, FORM, PLACE, everything, forms_at, inputs_at, middle, named, states_of, wrote

from freelearn.common.errors import UserError
from freelearn.physics.chain.parameters import Parameters
from freelearn.physics.effects.effect_check import check_effects
from freelearn.physics.effects.registry import EFFECTS, lent
from freelearn.physics.models import own_files
from freelearn.physics.models.build import build_model
from freelearn.physics.models.own_files import load_own
from freelearn.physics.written.forms import ENERGIES, ONE, TWO
from freelearn.physics.written.places import PLACES
from freelearn.physics.written.source import effect_class, source
from freelearn.testing.effects import TRUTH

WIDTH = 120
FEW = ("linear_and_cube", "hinge", "wave", "step", "power_times_linear", "bump_times_linear")


@pytest.fixture(autouse=True)
def library(monkeypatch):
    """Leaves the library as it was."""
    monkeypatch.setattr(own_files, "_READ", {})
    before = dict(EFFECTS)
    yield
    for name in set(EFFECTS) - set(before):
        del EFFECTS[name]
    assert before == EFFECTS


def samples():
    """Every form at one place, and a few at every place with all its inputs."""
    for place in PLACES:
        for inputs in inputs_at(place):
            for form in forms_at(place, inputs):
                if place.energy or form.word in FEW or place.name == "boundary pressure":
                    yield wrote(place, inputs, form)


def test_names_are_words_of_which_none_is_anothers_or_the_librarys():
    names = [wrote(*one).name for one in everything()]
    assert len(names) > 1000
    assert all(name.isidentifier() and name == name.lower() for name in names)
    assert len(set(names)) == len(names)
    assert not set(names) & set(EFFECTS)


def test_formulas_have_no_gap_and_name_every_input_and_every_constant():
    for place, inputs, form in everything():
        written = wrote(place, inputs, form)
        formula = written.formula
        assert "{" not in formula, written.name
        assert "}" not in formula, written.name
        assert formula.startswith(f"Δ{place.symbol} = ")
        body = formula.split("=", 1)[1]
        for i in inputs:
            assert i.symbol in body, written.name
        for symbol in written.amount_symbols:
            assert re.search(rf"(?<![a-z]){symbol}(?![a-z(])", body), written.name
        # Exponents are written above the line.
        for c in written.constants()[len(form.terms) :]:
            assert c.symbol in body or {"n": "ⁿ"}.get(c.symbol, c.symbol) in body, (written.name, formula, c.symbol)


def python(formula: str) -> str:
    """A formula of x, y, a and b as Python would have it: products have a sign there."""
    text = formula.format(x="x", y="y", a="a", b="b").replace("−", "-").replace("₀", "0").replace("sgn x", "sgn(x)")
    text = re.sub(r"\|([^|]*)\|", r"abs(\1)", text)
    for shown, power in (("²", "2"), ("³", "3"), ("⁴", "4"), ("ⁿ", "n")):
        text = text.replace(shown, f"**{power}")
    return re.sub(r"(?<=[\w)])\s+(?=[\w(])", "*", text)


@pytest.mark.parametrize("kind", ["ONE", "TWO", "ENERGIES"])
def test_what_a_formula_says_is_what_its_terms_are(kind):
    """Read as a reader reads it."""
    known = {name: getattr(np, name) for name in ("sin", "cos", "exp", "tanh", "abs")}
    known |= {"max": np.maximum, "sgn": np.sign, "ln": np.log}
    generator = np.random.default_rng(0)
    x, y = generator.uniform(-1, 1, (2, 200))
    for form in {"ONE": ONE, "TWO": TWO, "ENERGIES": ENERGIES}[kind]:
        shapes = middle(form)
        letters = {"knee": "x0", "center": "x0", "jump": "x0", "exponent": "n"}
        own = {letters.get(name, "k"): value for name, value in shapes.items()}
        # Of two inputs the shape is that of the input that its symbol names.
        own |= {"y0": own["x0"]} if "x0" in own else {}
        said = eval(python(form.formula), known | own | {"x": x, "y": y, "a": 0.7, "b": -0.4})
        inputs = [torch.as_tensor(v) for v in ((x, y) if form.inputs == 2 else (x,))]
        terms = form.values(inputs, shapes)
        value = sum(amount * term for amount, term in zip((0.7, -0.4), terms, strict=False))
        # A step has a width in the file, four thousandths of the scale.
        far = np.abs(x - own.get("x0", -9)) > 0.1 if form.family == "step" else x == x
        np.testing.assert_allclose(np.broadcast_to(said, x.shape)[far], value.numpy()[far], rtol=1e-5, atol=1e-7)


def test_frictions_of_two_terms_turn_with_the_pressure_as_a_whole():
    assert named("dissipation force", "force", "linear_and_square").formula == "ΔF = −sgn(ΔP) · (a F + b F²)"


def test_an_effect_that_a_friction_makes_says_that_it_follows_the_pressures_direction():
    for place in PLACES:
        written = next(wrote(place, inputs, forms_at(place, inputs)[0]) for inputs in inputs_at(place))
        rubs = place.port == "dissipation" and place.where != "wall"
        assert ("direction" in written.inputs_named) == rubs
        assert ("sgn(ΔP)" in written.formula) == rubs


def test_starts_lie_within_bounds_and_amounts_have_none():
    for place, inputs, form in everything():
        written = wrote(place, inputs, form)
        constants = written.constants()
        assert len({c.name for c in constants}) == len(constants) == form.count
        for c in constants:
            assert c.name.isidentifier()
            assert not hasattr(Parameters, c.name)
            assert c.lower <= c.start <= c.upper, (written.name, c)
            assert c.lower < c.upper
            assert c.amount == (c.lower == -c.upper == float("-inf"))
        # Every value tried of a shape lies within its bounds too.
        for shape, tried in product(form.shapes, form.grid()):
            assert shape.lower <= tried[shape.name] <= shape.upper


def test_texts_compile_and_keep_to_the_line():
    count = 0
    for written in samples():
        text = source(written)
        tree = ast.parse(text)
        compile(tree, written.name, "exec")
        assert max(map(len, text.splitlines())) <= WIDTH, text
        assert ast.get_docstring(tree)
        assert text.endswith("\n")
        assert "{" not in text.replace("{}", ""), text
        count += 1
    assert count > 400


def test_texts_with_values_as_a_fit_leaves_them_keep_to_the_line_too():
    """Sixteen digits and an exponent in every number."""
    for place, inputs, form in everything():
        if len(inputs) == 2 and place.name not in ("boundary length", "parallel both", "dissipation moment"):
            continue
        written = wrote(place, inputs, form, each=True)
        long = written.started({c.name: c.start * 1.2345678901234567 for c in written.constants()})
        text = source(long)
        assert max(map(len, text.splitlines())) <= WIDTH, text


def test_ruff_finds_nothing_in_the_files(tmp_path):
    """Neither its format nor its rules, as of the package itself; the docstring's first line may be long."""
    for i, written in enumerate(samples()):
        if i % 5 == 0:
            (tmp_path / f"proposed_{written.name}.py").write_text(source(written), encoding="utf-8")
    for command in (["format", "--diff"], ["check", "--select", "F,I,UP,B", "--no-cache"]):
        done = subprocess.run(
            [sys.executable, "-m", "ruff", *command, "--isolated", "--line-length", str(WIDTH), str(tmp_path)],
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, (done.stdout + done.stderr)[:3000]


FILES = [
    *((place.name, " ".join(i.name for i in next(inputs_at(place))), None) for place in PLACES),
    ("boundary length", "force", "odd_square"),
    ("boundary twist", "elongation moment", "hinge_times_linear"),
    ("geometry outer_radius", "pressure time", "bump_times_linear"),
    ("energy i4", "i4", "tension"),
    ("parallel both", "elongation twist", "wave_times_linear"),
    ("dissipation moment", "pressure force", "modulus_times_square"),
]


@pytest.mark.parametrize(("place", "inputs", "form"), FILES)
def test_a_written_file_loads_like_an_effect_of_ones_own(place, inputs, form, tmp_path):
    here = PLACE[place]
    form = form or ("cube" if len(inputs.split()) == 1 else "linear_times_square")
    written = named(place, inputs, form)
    path = tmp_path / f"proposed_{written.name}.py"
    path.write_text(source(written), encoding="utf-8")
    assert load_own([str(path)]) == [written.name]
    kind = EFFECTS[written.name]
    assert kind.problem() is None
    assert kind.suspect
    assert kind.source
    declared = {p.name: p for p in kind.declared_parameters()}
    for c in written.constants():
        p = declared[c.name]
        assert (p.start, p.unit, p.none) == (c.start, c.unit, 0.0 if c.amount else None)
        assert (p.lower, p.upper) == (c.lower, c.upper)
    families = [family for family in ("continuum", "linear") if family in kind.families()]
    assert families == (["continuum"] if here.energy else ["continuum", "linear"])
    for family in families:
        model = build_model(family, TRUTH[family], [written.name])
        check_effects(model.effects, model.values(), states_of())
        shown, status = model(states_of())
        assert (status == 0).all()
        assert shown.isfinite().all()


def test_the_file_and_the_class_that_a_search_fits_are_the_same(tmp_path):
    written = named("boundary twist", "twist pressure", "sine_times_linear")
    (tmp_path / "proposed.py").write_text(source(written), encoding="utf-8")
    with lent([effect_class(written)]):
        searched = build_model("continuum", TRUTH["continuum"], [written.name])
    load_own([str(tmp_path / "proposed.py")])
    loaded = build_model("continuum", TRUTH["continuum"], [written.name])
    assert searched.scalars() == loaded.scalars()
    torch.testing.assert_close(searched(states_of()).loads, loaded(states_of()).loads, rtol=0, atol=0)


def test_a_second_file_of_the_same_name_is_refused(tmp_path):
    written = named("measurement force", "force", "square")
    for name in ("one.py", "two.py"):
        (tmp_path / name).write_text(source(written), encoding="utf-8")
    with pytest.raises(UserError, match=rf"'{written.name}' is taken"):
        load_own([str(tmp_path / "one.py"), str(tmp_path / "two.py")])


def test_what_was_measured_stands_in_the_files_docstring(tmp_path):
    written = named("measurement force", "force", "square")
    told = wrote(written.place, written.inputs, written.form, lines=("It mends 3 %.", "", "And so on."))
    assert "It mends 3 %.\n\nAnd so on." in ast.get_docstring(ast.parse(source(told)))
    # One effect, with or without evidence.
    assert source(told).split('"""', 2)[2] == source(written).split('"""', 2)[2]


def test_every_form_of_two_inputs_is_there_both_ways_round_or_is_its_own_mirror():
    words = [(form.word, form.turned) for form in TWO]
    assert len(set(words)) == len(words)
    for form in TWO:
        first, second = form.word.split("_times_")
        assert first in FORM
        assert second in FORM
        other = f"{second}_times_{first}", False
        assert (form.word, not form.turned) in words or other in words
    assert len(ENERGY) == len(ENERGIES)
