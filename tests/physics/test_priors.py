"""What is known of parameters beforehand: declared everywhere, with a source, and wide enough for what there is."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from freelearn.data.beds import DEAD_LOAD
from freelearn.data.rows import Readings, Rows
from freelearn.data.states import States
from freelearn.physics.chain.material import MATERIALS, material
from freelearn.physics.chain.parameters import Prior
from freelearn.physics.chain.priors import raw_prior, spans
from freelearn.physics.effects.registry import EFFECTS
from freelearn.physics.models.build import MODELS, build_model
from freelearn.physics.models.linear import Linear
from freelearn.physics.models.stated_knowledge import stated

# Largest loads of a common bed [N, N·m].
SPANS = {"force": 50.0, "moment": 0.5}
OWN = [(kind.name, p) for kind in MODELS.values() if kind is not Linear for p in kind.parameter_class.records()]
ALL = [*OWN, *((name, p) for name, effect in EFFECTS.items() for p in effect.declared_parameters())]
# So soft that no tube of it holds a pressure, so hard that none swells, or no rubber: who has one says so.
RARE = {"dragon_skin_fx_pro_slacker", "ecoflex_00_10", "tpu_cheetah", "artery"}


@pytest.mark.parametrize(("owner", "p"), ALL, ids=lambda x: getattr(x, "name", x))
def test_every_parameter_has_a_prior_with_a_source_that_holds_its_start(owner, p):
    assert isinstance(p.prior, Prior)
    assert len(p.prior.source) > 10
    assert p.prior.deviation > 0
    assert p.prior.of in ("", *SPANS)
    low, high = p.plausible(SPANS)
    assert low <= p.start <= high
    if p.none is not None:
        # The middle is that nothing is there, and what was called noticeable is not far out.
        assert p.prior.middle == p.none
        assert low <= p.none <= high
        assert min(abs(p.scale - p.none), high) <= high


@pytest.mark.parametrize("name", MATERIALS)
def test_what_tubes_are_made_of_is_plausible_for_the_wall(name):
    (wall,) = [p for owner, p in OWN if owner == "continuum" and p.name == "C1"]
    low, high = wall.plausible({})
    stock = MATERIALS[name]
    assert (low <= stock.C1 <= high) is (name not in RARE)
    assert len(stock.source) > 10
    # Nobody knows a rubber better than by a quarter, and every one better than all of them.
    assert 0.25 <= stock.deviation < wall.prior.deviation


def test_the_catalog_says_what_the_measured_curves_say(shared_data):
    folder = shared_data / "elastomers"
    if not folder.is_dir():
        pytest.skip("no curves of elastomers in the shared data")
    seen = 0
    for path in sorted(folder.glob("*.csv")):
        known = path.stem.removesuffix(" MEDIUM").replace("SortaClear", "Sorta Clear")
        stretch, stress = curve(path)
        shape = stretch - stretch**-2
        fitted = float(shape @ stress / (shape @ shape))
        assert abs(material(known).C1 / fitted - 1) < 0.03, path.stem
        seen += 1
    assert seen == 19


def curve(path):
    """Stretch and nominal stress [Pa] up to 100 %."""
    lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    begin = next(i for i, line in enumerate(lines) if line.startswith("Time"))
    rows = [line.replace(",", ".").split(";")[3:5] for line in lines[begin + 1 :] if line.count(";") >= 4]
    strain, stress = np.array([row for row in rows if all(row)], dtype=float).T
    few = (strain > 0.02) & (strain <= 1.0)
    return 1 + strain[few], 1e6 * stress[few]


def test_weights_and_the_entries_of_a_matrix_have_none():
    for name in ("mlp", "linear"):
        assert not bool(raw_prior(build_model(name), SPANS).covariance.diagonal().isfinite().any())


def test_what_sensors_err_by_counts_in_the_largest_load():
    model = build_model("continuum", effects=["force_offset"])
    deviations = [float(raw_prior(model, {"force": n}).covariance[2, 2]) ** 0.5 for n in (10.0, 100.0)]
    assert deviations == pytest.approx([0.5, 5.0])


def test_where_loads_are_hung_the_pressures_push_counts_too():
    """A bore of 5 mm under 100 kPa pushes with 7.85 N, at a lever of 5 mm; three of them thrice that."""
    one = torch.ones(3, dtype=torch.float64)
    tube = {
        "fiber_angle": 0.5 * one, "reference_length": 0.1 * one, "inner_radius": 5e-3 * one, "outer_radius": 6e-3 * one,
        "length": 0.1 * one, "twist": 0 * one, "pressure": torch.tensor([0.0, -1e5, 5e4], dtype=torch.float64),
        "sample": torch.ones(3, dtype=torch.int64), "direction": one,
    }  # fmt: skip
    hung = States(**tube, force=2 * one, moment=0 * one, bed=DEAD_LOAD)
    readings, state = Readings.whole(torch.zeros(3, 2, dtype=torch.float64)), np.zeros(3, dtype=int)
    thrust = np.pi * 5e-3**2 * 1e5
    assert spans(Rows(hung, readings, state)) == pytest.approx({"force": thrust, "moment": thrust * 5e-3})
    three = hung.replace(members=(States(**tube),) * 3)
    assert spans(Rows(three, readings, state)) == pytest.approx({"force": 3 * thrust, "moment": 3 * thrust * 5e-3})
    heavy = hung.replace(force=-30 * one, moment=one)
    assert spans(Rows(heavy, readings, state)) == pytest.approx({"force": 30.0, "moment": 1.0})
    # A force that is read is what it is.
    pulled = Rows(States(**tube), Readings.whole(torch.tensor([[3.0, 0.01]] * 3, dtype=torch.float64)), state)
    assert spans(pulled) == pytest.approx({"force": 3.0, "moment": 0.01})


def test_each_actuator_of_a_block_has_a_strength_of_its_own_drawn_towards_a_common_one():
    """Four fifths of what is not known of the pressure's effect they have in common; on the linear model too."""
    model = build_model("linear", {}, ["pressure_gain"], members=3)
    prior = raw_prior(model, {})
    place = [model.labels().index(f"pressure_gain.gain[{n}]") for n in (1, 2, 3)]
    covariance = prior.covariance[place][:, place] / 0.05**2
    expected = torch.full((3, 3), 0.8, dtype=torch.float64).fill_diagonal_(1.0)
    torch.testing.assert_close(covariance, expected)


def test_values_of_several_samples_differ_by_less_than_their_common_value():
    model = build_model("continuum", effects=["fiber_misalignment"], samples=[1, 2])
    covariance = raw_prior(model, {}).covariance[2:, 2:]
    torch.testing.assert_close(
        covariance, 0.05**2 * torch.tensor([[1.0, 0.8], [0.8, 1.0]], dtype=torch.float64), rtol=1e-12, atol=0
    )


def test_an_artery_brings_its_fibers():
    """Of the rabbit's carotid, Holzapfel et al. (2000): 3 and 0.3 kPa; collagen 2.4 and 0.56 kPa; Gasser et al. (2006):
    996.6 kPa. Nothing of that is rubber or thread."""
    known = stated("continuum", of="artery")
    for name, moduli in (("C1", (3e3, 0.3e3, 7.64e3)), ("C2", (2.4e3, 0.56e3, 996.6e3))):
        low, high = replace(build_model("continuum").declared[name], prior=known.priors[name]).plausible({})
        assert all(low < modulus < high for modulus in moduli), name
        assert known.starts[name] == known.priors[name].middle
    told = stated("continuum", values={"C2": 7e4}, errors={"C2": 1e4}, of="artery")
    assert told.priors["C2"].middle == 7e4
    assert "C2" not in stated("continuum", of="latex").priors


def test_numbers_that_are_one_differ_by_a_thousandth_and_are_known_as_well():
    model = build_model("continuum", {}, ["sensor_lag"])
    labels = model.labels()
    names = ["sensor_lag.force", "sensor_lag.moment"]
    prior = raw_prior(model, {})
    tied = prior.tied(labels, names)
    a, b = (labels.index(name) for name in names)
    difference = tied.covariance[a, a] + tied.covariance[b, b] - 2 * tied.covariance[a, b]
    assert float(difference.sqrt()) == pytest.approx(1e-3 * float(prior.covariance[a, a].sqrt()), rel=1e-3)
    assert torch.equal(tied.covariance.diagonal(), prior.covariance.diagonal())
    assert torch.equal(tied.middle, prior.middle)


@pytest.mark.parametrize("given", [Prior(0.0, 0.01, "a data sheet"), Prior(0.1, 0.2, "a data sheet")])
def test_what_a_user_knows_of_one_of_them_is_kept(given):
    model = build_model("continuum", {}, ["sensor_lag"])
    prior = raw_prior(model, {}, {"sensor_lag.force": given})
    assert prior.tied(model.labels(), ["sensor_lag.force", "sensor_lag.moment"]) is prior
