"""Effects that braided muscles need, against volumes, energies and limits found another way; all effects on braids."""

import math

import numpy as np
import pytest
import torch
from scipy.integrate import quad

from freelearn.common.errors import UserError
from freelearn.data.states import States
from freelearn.physics.effects.registry import EFFECTS, make_effects
from freelearn.physics.models.build import build_model
from freelearn.physics.models.rubber import Rubber, isotropic_effects
from freelearn.testing.contract_checks import parameter_derivatives, reciprocal, state_derivatives
from freelearn.testing.effects import TRUTH, labels_of
from freelearn.testing.reference import total_energy
from freelearn.testing.small_tables import visits

BRAID = {"gamma_deg": 24.0, "gamma2_deg": -24.0, "length_mm": 150.0, "inner_radius_mm": 5.0, "outer_radius_mm": 6.2}


def tensor(*x: float) -> torch.Tensor:
    return torch.tensor(x, dtype=torch.float64)


def braid_table(**columns):
    return visits(samples=(3,)).assign(**BRAID | columns)


def braids(**columns) -> States:
    return States.from_table(braid_table(**columns))


def singles() -> States:
    return States.from_table(visits())


def own(name: str, **values: float):
    """The effect and its parameters."""
    effect = EFFECTS[name]()
    return effect, effect.own({f"{name}.{p}": tensor(v)[0] for p, v in values.items()})


# --- contracts on two families --------------------------------------------------------------------------------


ANGLES = [(24.0, -24.0), (-24.0, 24.0), (-40.0, math.nan), (30.0, -50.0)]
# By day each effect on one of them, the next effect on the next one.
OF_EACH = [
    pytest.param(name, angles, marks=[pytest.mark.nightly] if (i - j) % len(ANGLES) else [])
    for i, name in enumerate(EFFECTS)
    for j, angles in enumerate(ANGLES)
]


@pytest.mark.parametrize(("name", "angles"), OF_EACH)
def test_every_effect_works_on_braids_and_on_fibers_wound_the_other_way(name, angles):
    states = braids(gamma_deg=angles[0], gamma2_deg=angles[1])
    kind = EFFECTS[name]
    steps = {f"{name}.{p.name}": 1e-4 if p.log else 1e-4 * p.scale for p in kind.declared_parameters()}
    for family in ("continuum", "linear"):
        if family in kind.families():
            values = TRUTH[family] | labels_of(name, "scale")
            model = build_model(family, values, [name])
            assert (model(states).status == 0).all()
            parameter_derivatives(model, states, steps)
            state_derivatives(model, states)
            if kind.port in ("boundary", "geometry", "energy"):
                reciprocal(model, states)


# What turns round with the fibers: a sign of these parameters.
TURNED = {
    "fiber_misalignment": ["angle"],
    "twist_offset": ["angle"],
    "friction_hysteresis": ["moment"],
    "contact_friction": ["moment"],
    "moment_offset": ["moment"],
    "sensor_crosstalk": ["moment_into_force", "force_into_moment"],
    "sensor_drift": ["moment_rate"],
}


@pytest.mark.parametrize("name", EFFECTS)
def test_an_actuator_wound_the_other_way_is_the_mirror_image(name):
    """With twist and fibers mirrored, the force stays and the moment changes its sign."""
    values = labels_of(name, "scale")
    other = {label: -v if label.split(".")[1] in TURNED.get(name, []) else v for label, v in values.items()}
    table = visits()
    mirrored = table.assign(gamma_deg=-table["gamma_deg"], twist_deg=-table["twist_deg"])
    first = build_model("continuum", TRUTH["continuum"] | values, [name])(States.from_table(table)).loads
    second = build_model("continuum", TRUTH["continuum"] | other, [name])(States.from_table(mirrored)).loads
    torch.testing.assert_close(second * tensor(1, -1), first, rtol=1e-9, atol=1e-9)


# --- fiber_misalignment ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("drawn", "built"),
    [((24, -24), (25, -25)), ((-24, 24), (-23, 23)), ((24, 40), (25, 41)), ((24, math.nan), (25, math.nan))],
)
def test_a_misaligned_braid_stays_its_own_mirror_image(drawn, built):
    effect, p = own("fiber_misalignment", angle=math.radians(1.0))
    shaped = effect.reshape(braids(gamma_deg=drawn[0], gamma2_deg=drawn[1]), p)
    expected = braids(gamma_deg=built[0], gamma2_deg=built[1])
    torch.testing.assert_close(shaped.fiber_angle, expected.fiber_angle)
    torch.testing.assert_close(shaped.second_angle, expected.second_angle)


def test_a_misaligned_braid_makes_no_moment_without_twist():
    states = braids(twist_deg=0.0)
    model = build_model("continuum", TRUTH["continuum"] | {"fiber_misalignment.angle": 0.03}, ["fiber_misalignment"])
    moments = model(states).loads[:, 1]
    torch.testing.assert_close(moments, torch.zeros_like(moments), atol=1e-9, rtol=0)


# --- end_taper ------------------------------------------------------------------------------------------------


def lost_volume(radius: float, rest: float, ratio: float) -> float:
    """What two cones lack of a cylinder of their length, by integrating along the axis."""
    length = ratio * abs(radius - rest)
    cone = quad(lambda z: math.pi * (rest + (radius - rest) * z / length) ** 2, 0, length, epsrel=1e-12)[0]
    return 2 * (math.pi * radius**2 * length - cone)


@pytest.mark.parametrize("twist", [0.0, 1.1])
def test_the_taper_takes_off_the_work_on_the_volume_that_the_cones_lack(twist):
    angle, rest, reference, pressure, ratio, h = math.radians(24), 6.2e-3, 0.15, 2e5, 2.5, 1e-6

    def radius(length: float, turn: float) -> float:
        # One family; without twist a braid has the same radius.
        fiber, wrap = reference / math.cos(angle), reference / rest * math.tan(angle)
        return math.sqrt(fiber**2 - length**2) / (wrap + turn)

    def volume(length: float, turn: float) -> float:
        return lost_volume(radius(length, turn), rest, ratio)

    here = 0.13
    expected = [
        -pressure * (volume(here + h, twist) - volume(here - h, twist)) / (2 * h),
        -pressure * (volume(here, twist + h) - volume(here, twist - h)) / (2 * h),
    ]
    columns = {"elongation_mm": -20.0, "twist_deg": math.degrees(twist), "pressure_kpa": pressure / 1e3}
    effect, p = own("end_taper", ratio=ratio)
    for second in (math.nan, -24.0) if twist == 0 else (math.nan,):
        states = braids(**columns, gamma2_deg=second)[slice(0, 1)]
        found = effect.dissipate(torch.zeros(1, 2, dtype=torch.float64), states, p)[0]
        # The cones vanish faster than in proportion near rest, by about half the square of 1 % of R_o over r − R_o.
        assert float(found[0]) == pytest.approx(expected[0], rel=1e-3)
        if math.isnan(second):
            assert float(found[1]) == pytest.approx(expected[1], rel=1e-3)
        else:
            assert abs(float(found[1])) < 1e-12


def test_the_taper_is_that_of_a_contraction_which_counts_more_than_once():
    """The force lost is in proportion to the contraction ε at first, as in F = −π R_o² P (a (1 − k ε)² − b)."""
    small = 0.02
    effect, p = own("end_taper", ratio=3.0)
    pushes = []
    for contraction in (small, 2 * small):
        states = braids(elongation_mm=-150 * contraction, twist_deg=0.0, pressure_kpa=200.0)[slice(0, 1)]
        pushes.append(float(effect.dissipate(torch.zeros(1, 2, dtype=torch.float64), states, p)[0, 0]))
    assert pushes[0] > 0
    assert pushes[1] / pushes[0] == pytest.approx(2, rel=0.15)


def test_the_taper_is_no_clamp():
    """A clamp stiffens a tube without pressure; the taper does nothing there, nor at rest."""
    states = braids(pressure_kpa=0.0)
    bare = build_model("continuum", TRUTH["continuum"])(states).loads
    tapered = build_model("continuum", TRUTH["continuum"] | {"end_taper.ratio": 5.0}, ["end_taper"])(states).loads
    assert torch.equal(bare, tapered)
    effect, p = own("end_taper", ratio=5.0)
    rest = braids(elongation_mm=0.0, twist_deg=0.0)
    taken = effect.dissipate(torch.zeros(len(rest), 2, dtype=torch.float64), rest, p)
    assert float(taken.abs().max()) < 1e-9


# --- contact_friction -----------------------------------------------------------------------------------------


def test_contact_friction_is_a_share_of_what_presses_on_the_surface():
    states = braids(twist_deg=0.0, elongation_mm=-12.0)
    effect, p = own("contact_friction", force=2e-3, moment=5e-4)
    found = effect.dissipate(torch.zeros(len(states), 2, dtype=torch.float64), states, p)
    # Tondu & Lopez: the radius of a braid of threads of constant length.
    length, angle = 0.138, math.radians(24)
    radius = 6.2e-3 * math.sqrt(1 - (length / 0.15 * math.cos(angle)) ** 2) / math.sin(angle)
    press = states.direction * states.pressure * 2 * math.pi * radius * length
    torch.testing.assert_close(found, -torch.stack([2e-3 * press, 5e-4 * radius * press], 1), rtol=1e-10, atol=0)
    assert not found[states.pressure == 0].any()
    assert found[states.direction < 0].min() > 0


# --- threshold_pressure ---------------------------------------------------------------------------------------


def acting(pressure: torch.Tensor, threshold: float) -> torch.Tensor:
    states = singles()[slice(0, 1)].replace(pressure=pressure)
    effect, p = own("threshold_pressure", pressure=threshold)
    return effect.impose(states, p).pressure


def test_the_threshold_is_a_smooth_maximum_of_zero_and_what_exceeds_it():
    threshold = 2e4
    pressure = torch.linspace(0, 3e5, 3001, dtype=torch.float64)
    found, sharp = acting(pressure, threshold), (pressure - threshold).clamp_min(0)
    assert (found >= -1e-9).all()
    assert (found >= sharp - 1e-9).all()
    assert float((found - sharp).max()) < 0.1 * threshold
    far = (pressure < 0.5 * threshold) | (pressure > 2 * threshold)
    # Up to a kilopascal the gauge may err, and half of what it shows there acts.
    near = pressure < 3e3
    assert float((found - sharp)[near].abs().max()) <= 500.0
    assert float((found - sharp)[far & ~near].abs().max()) <= 1.001 * 300.0
    assert float((found - sharp)[pressure > 2 * threshold].abs().max()) < 1e-2 * threshold
    assert torch.equal(acting(pressure, 0.0), pressure)


def test_a_gauge_that_errs_about_zero_is_no_threshold():
    """The reading's sign is chance there, so that what made less of it would fit better: next to nothing is lost."""
    reading = tensor(-150, -15, 15, 150)
    lost = (reading - acting(reading, 300.0)) / reading
    assert (lost > 0).all()
    assert float(lost.max()) < 0.01
    torch.testing.assert_close(lost[[0, 1]], lost[[3, 2]])


@pytest.mark.parametrize("threshold", [0.0, 1.0, 1e3, 3e4])
def test_neither_slope_of_the_threshold_exceeds_one(threshold):
    pressure = torch.linspace(-1e5, 1e5, 401, dtype=torch.float64)
    effect, here = EFFECTS["threshold_pressure"](), singles()[slice(0, 1)]

    def shown(at, level):
        p = effect.own({"threshold_pressure.pressure": level})
        return effect.impose(here.replace(pressure=at), p).pressure.sum()

    level = tensor(threshold).expand(401)
    for slope in torch.func.vmap(torch.func.grad(shown, argnums=(0, 1)))(pressure[:, None], level):
        assert slope.isfinite().all()
        assert float(slope.abs().max()) <= 1 + 1e-9


def test_a_threshold_leaves_rows_without_pressure_and_an_offset_does_not():
    states = singles()
    bare = build_model("continuum", TRUTH["continuum"])(states).loads
    for name, moved in (("threshold_pressure", False), ("pressure_offset", True)):
        loads = build_model("continuum", TRUTH["continuum"] | labels_of(name, "scale"), [name])(states).loads
        assert bool((loads - bare)[states.pressure == 0].any()) == moved


# --- bladder_stiffness ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("make", [braids, singles])
def test_the_bladder_is_that_of_a_potential_with_a_liner(make):
    """The reference bed's potential, and the liner's from its own deformation: bisection, complex steps."""
    states, c1, c2, stiffness, step = make(), 6e5, 2e7, 1500.0, 1e-30
    s = {name: getattr(states, field).numpy() for name, field in
         {"gamma": "fiber_angle", "reference": "reference_length", "inner": "inner_radius", "outer": "outer_radius",
          "length": "length", "twist": "twist", "pressure": "pressure"}.items()}  # fmt: skip
    gammas = [s["gamma"]] + ([states.second_angle.numpy()] if states.second_angle is not None else [])
    design = (gammas, s["reference"], s["inner"], s["outer"], np.ones(len(states)), c1, c2, {})

    def potential(length, twist, u):
        along, hoop = length / s["reference"], u / s["inner"] ** 2
        # F of the membrane: (λz, r k; 0, r/R) in (z, θ), and the thickness that keeps its volume.
        slide = u * (twist / s["reference"]) ** 2
        i1 = along**2 + slide + hoop + 1 / (along**2 * hoop)
        liner = 2 * np.pi * s["inner"] * s["reference"] * stiffness / 2 * (i1 - 3)
        return total_energy.wall_energy(length, twist, u, *design) + liner - s["pressure"] * np.pi * u * length

    low, high = (0.3 * s["inner"]) ** 2, (2.5 * s["inner"]) ** 2
    for _ in range(60):
        middle = (low + high) / 2
        above = potential(s["length"], s["twist"], middle + 1j * step).imag > 0
        low, high = np.where(above, low, middle), np.where(above, middle, high)
    force = -potential(s["length"] + 1j * step, s["twist"], middle).imag / step
    moment = -potential(s["length"] + 0j, s["twist"] + 1j * step, middle).imag / step
    values = {"C1": c1, "C2": c2, "bladder_stiffness.stiffness": stiffness}
    model = build_model("continuum", values, ["bladder_stiffness"])
    torch.testing.assert_close(model(states).loads, torch.as_tensor(np.stack([force, moment], 1)), rtol=1e-7, atol=1e-8)


def test_a_bladder_is_not_more_of_the_wall():
    """No C1 and C2 make up for it in all rows: what is left of its derivative is more than rounding."""
    values = TRUTH["continuum"] | labels_of("bladder_stiffness", "scale")
    model, states = build_model("continuum", values, ["bladder_stiffness"]), singles()
    rate = torch.func.jacfwd(lambda v: model(states, model.physical(v)).loads)(model.vector().detach()).flatten(0, 1)
    rate = rate / rate.norm(dim=0)
    fitted = torch.linalg.lstsq(rate[:, :2], rate[:, 2:]).solution
    assert float((rate[:, 2:] - rate[:, :2] @ fitted).norm()) > 1e-3


def test_a_rubber_specimen_has_no_bore():
    assert "second_invariant_log" in isotropic_effects()
    assert "bladder_stiffness" not in isotropic_effects()
    with pytest.raises(UserError, match="bore"):
        Rubber(["bladder_stiffness"])


def test_an_energy_at_the_bore_takes_no_fibers():
    kind = EFFECTS["bladder_stiffness"]
    assert "bore" in type("Odd", (kind,), {"depends_on": ("i4",)}).problem()


def test_the_names_of_effects_are_made_in_the_chains_order():
    taper_then_friction = make_effects(["contact_friction", "end_taper"], "continuum")
    assert [effect.name for effect in taper_then_friction] == ["end_taper", "contact_friction"]
