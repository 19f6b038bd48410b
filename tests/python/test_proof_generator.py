from __future__ import annotations

import ast
import json
from dataclasses import replace
from pathlib import Path

import hdfast
import numpy as np
import pytest
from hdfast.proof import generator
from hdfast.proof.generator import further, nuisance, sensors, stepping, strata
from hdfast.proof.generator.case import build, motion, simulate, sized_within_limits
from hdfast.proof.generator.certificate import likeness, rivals
from hdfast.proof.generator.control import NO_NOTCH, Controller
from hdfast.proof.generator.effects import EFFECTS, TWELVE, Drive
from hdfast.proof.generator.equipment import draw_chain
from hdfast.proof.generator.imposed import COARSE, impose
from hdfast.proof.generator.linear import linearise, moved
from hdfast.proof.generator.oracle import oracle
from hdfast.proof.generator.plant import ABSENT, Plant, empty_arrays
from hdfast.proof.generator.recipe import Bench, Recipe
from hdfast.proof.generator.responses import Motion, channels, moving, responses, told_by_motion
from hdfast.proof.generator.rig import draw_rig
from hdfast.proof.generator.sizing import follow, length, sketch, swallowed, together
from hdfast.proof.generator.truth import refitted
from hdfast.proof.generator.whitening import whiten
from hdfast.proof.seal import checksums
from hdfast.recordings import load_campaign
from scipy import integrate
from scipy.optimize import least_squares

OPEN = Controller(0, 0.0, 0.0, 0.0, 1e9, 20, 1e-9, 1.0, 0.0, 0.0, NO_NOTCH)
T = np.arange(4000) * stepping.GRID
SMOOTH_PUSH = 0.1 * np.sin(2 * np.pi * 1.5 * T) * np.clip(T / 0.2, 0.0, 1.0) ** 2 * (3 - 2 * np.clip(T / 0.2, 0.0, 1.0))


def plant(**changes):
    lines = {"te_order": np.array([1.0, 2.0]), "te_amplitude": np.array([2e-5, 9e-5]), "te_phase": np.array([0.3, 1.0])}
    values = {
        "ratio": 121.0, "J_r": 1.9e-4, "J_w": 1.1e-4, "J_f": 0.03, "J_p": 0.47, "k_i": 800.0, "c_i": 0.02, "k_c": 2e5,
        "c_c": 60.0, "B_m": 1.2e-3, "B_l": 0.5, "B_sp": 20.0, "k1": 3.1e4, "k3": 1.3e10, **lines, **empty_arrays(),
        **ABSENT,
    }  # fmt: skip
    return Plant(**{**values, **changes})


def drive(p, push=SMOOTH_PUSH, load=0.0, angle=0.4):
    zero = np.zeros_like(T)
    start = stepping.start_at_rest(p, angle, load)
    out = stepping.run(p, OPEN, push, zero + load, zero + 20.0, zero, start)
    return dict(zip(stepping.TRACES + stepping.INNER, out, strict=True))


def right_hand_side(p, push):
    """The four inertias written out again, without friction."""

    def rates(t, y):
        q, v = y[:4], y[4:]
        error = sum(a * np.cos(n * q[1] + f) for n, a, f in zip(p.te_order, p.te_amplitude, p.te_phase, strict=True))
        slope = -sum(
            a * n * np.sin(n * q[1] + f) for n, a, f in zip(p.te_order, p.te_amplitude, p.te_phase, strict=True)
        )
        local = 1 / p.ratio - slope
        windup = q[1] / p.ratio - error - q[2]
        gear = p.k1 * windup + p.k3 * windup**3 + p.B_sp * (local * v[1] - v[2])
        first = p.k_i * (q[0] - q[1]) + p.c_i * (v[0] - v[1])
        last = p.k_c * (q[2] - q[3]) + p.c_c * (v[2] - v[3])
        forces = [np.interp(t, T, push) - first, first - p.B_m * v[1] - local * gear, gear - last, last - p.B_l * v[3]]
        return np.concatenate([v, np.array(forces) / [p.J_r, p.J_w, p.J_f, p.J_p]])

    return rates


def test_against_scipy_lsoda_the_four_inertias():
    p = plant()
    seen = drive(p)
    start = np.concatenate([stepping.start_at_rest(p, 0.4, 0.0), np.zeros(4)])
    part = T[:1600]
    exact = integrate.solve_ivp(
        right_hand_side(p, SMOOTH_PUSH), (0.0, part[-1]), start, method="LSODA", t_eval=part, rtol=1e-9, atol=1e-12
    )
    for row, name in enumerate(("motor_angle", "wave_angle", "load_angle", "payload_angle")):
        assert np.ptp(exact.y[row]) > 1e-3
        np.testing.assert_allclose(seen[name][: part.size], exact.y[row], atol=2e-5 * np.ptp(exact.y[row]))


def test_exact_energy_balance():
    p = plant()
    s = drive(p)
    slope = -sum(
        a * n * np.sin(n * s["wave_angle"] + f) for n, a, f in zip(p.te_order, p.te_amplitude, p.te_phase, strict=True)
    )
    windup_rate = (1 / p.ratio - slope) * s["wave_speed"] - s["load_speed"]
    kinetic = sum(
        0.5 * J * s[v] ** 2
        for J, v in ((p.J_r, "motor_speed"), (p.J_w, "wave_speed"), (p.J_f, "load_speed"), (p.J_p, "payload_speed"))
    )
    stored = (
        0.5 * p.k1 * s["windup"] ** 2
        + 0.25 * p.k3 * s["windup"] ** 4
        + 0.5 * p.k_i * (s["motor_angle"] - s["wave_angle"]) ** 2
        + 0.5 * p.k_c * (s["load_angle"] - s["payload_angle"]) ** 2
    )
    lost = (
        p.B_m * s["wave_speed"] ** 2
        + p.B_l * s["payload_speed"] ** 2
        + p.B_sp * windup_rate**2
        + p.c_i * (s["motor_speed"] - s["wave_speed"]) ** 2
        + p.c_c * (s["load_speed"] - s["payload_speed"]) ** 2
    )
    energy = kinetic + stored
    supplied = integrate.simpson(SMOOTH_PUSH * s["motor_speed"] - lost, x=T)
    turned_over = integrate.simpson(np.abs(SMOOTH_PUSH * s["motor_speed"]), x=T)
    assert abs(energy[-1] - energy[0] - supplied) < 1e-6 * turned_over


def test_exact_dry_friction_holds_below_its_level_and_stops_in_a_straight_line():
    p = plant(T_c=0.05, B_m=0.0, B_l=0.0, te_amplitude=np.zeros(2))
    held = drive(p, push=0.0499 * np.clip(T / 0.5, 0.0, 1.0))
    assert np.max(np.abs(held["wave_speed"])) < 1e-12
    pushed = drive(p, push=np.where(T < 0.3, 0.15, 0.0))
    inertia = p.J_r + p.J_w + (p.J_f + p.J_p) / p.ratio**2
    coasting = (T > 0.35) & (pushed["motor_speed"] > 5.0)
    slope = np.polyfit(T[coasting], pushed["motor_speed"][coasting], 1)[0]
    assert slope == pytest.approx(-p.T_c / inertia, rel=2e-3)
    assert np.all(np.abs(pushed["wave_speed"][-200:]) < 1e-9)


def test_exact_slip_elements_close_minor_loops():
    from hdfast.proof.generator.laws import slip

    p, elements = plant(T_h=2.0, phi_h=3e-4), np.zeros(10)
    path = np.concatenate([np.linspace(0, 8e-4, 200), np.linspace(8e-4, 3e-4, 200), np.linspace(3e-4, 8e-4, 200)])
    torque = [slip(p, elements, change)[0] for change in np.diff(path, prepend=0.0)]
    assert torque[199] == pytest.approx(2.0)
    assert torque[-1] == pytest.approx(torque[199], abs=1e-12)


FAR = 0.1 * (np.arange(10) + 0.5) / 5.0  # windups at which the elements of phi_h = 0.1 slip [rad]


@pytest.mark.parametrize(
    "remembers", [{"T_h": 6e4 / np.sum(1.0 / FAR), "phi_h": 0.1}, {"K_v": 6000.0, "tau_v": 1e9}], ids=["slip", "creep"]
)
def test_exact_a_memory_that_does_not_fade_is_a_spring(remembers):
    """Elements that never slip, and a branch that never creeps: also in what they damp from step to step."""
    p, push = plant(), np.where(T < 0.1, 0.2, 0.0)
    stiffer = p._replace(k1=p.k1 + 6000.0)
    spring, memory = (drive(one, push=push)["load_angle"] for one in (stiffer, p._replace(**remembers)))
    np.testing.assert_allclose(memory, spring, atol=1e-6 * np.ptp(spring))
    t, begin = COARSE * np.arange(2000), stepping.start_at_rest(p, 0.0, 0.0)[2:]
    swing, still = np.where(t < 0.2, np.sin(10.0 * np.pi * t), 0.0), np.zeros(t.size)
    spring, memory = (
        impose(one, swing, np.gradient(swing, COARSE), still, still, still + 20.0, begin)[3]
        for one in (stiffer, p._replace(**remembers))
    )
    np.testing.assert_allclose(memory, spring, atol=1e-6 * np.ptp(spring))


def test_exact_a_sloshing_mass_hangs_still_until_the_drive_moves():
    p = plant(slosh_inertia=1.0, slosh_frequency=3.0, slosh_damping=0.02)
    begin, still = stepping.start_at_rest(p, 2.0, 0.0), np.zeros(2000)
    driven = drive(p, push=0.0 * T, angle=2.0)
    imposed = impose(p, still + 2.0, still, still, still, still + 20.0, begin[2:])
    for speed in (driven["load_speed"], driven["payload_speed"], imposed[stepping.TRACES.index("load_speed")]):
        assert np.max(np.abs(speed)) < 1e-9


def test_exact_torque_of_the_spring_is_the_slope_of_its_energy():
    from hdfast.proof.generator.laws import spring

    p, step = plant(delta_K=1.2e4, phi_0=4e-5, half_gap=1e-5), 1e-7
    for windup in (-3e-4, -2e-5, 3e-5, 1e-4, 1e-3):
        below, above = (spring(p, windup + side)[2] for side in (-step, step))
        assert (above - below) / (2.0 * step) == pytest.approx(spring(p, windup)[0], rel=1e-5)


def test_exact_published_parameters_are_those_of_the_catalogues_laws():
    """Compliances add up, two Maxwell branches share their stiffness, and breakaway counts from the sliding level."""
    bare = Drive(plant(k_c=2e6, T_c=0.04), sensors.SOUND)
    told = {
        effect_id: EFFECTS[effect_id].parameters(EFFECTS[effect_id].on(bare, amplitude, shape))
        for effect_id, amplitude, shape in (
            ("load_compliance", 1e-5, {"c_c": 8.0}), ("viscoelastic", 1500.0, {"tau_v": 0.4}),
            ("stribeck_friction", 0.01, {"omega_s": 4.0}), ("te_harmonic", 1e-5, {"te_extra_order": 6.0}),
        )
    }  # fmt: skip
    assert told == {
        "load_compliance": {"K_c": pytest.approx(1.0 / (1e-5 + 0.5e-6))},
        "viscoelastic": {"K_v": 3000.0, "tau_short": 0.4},
        "stribeck_friction": {"breakaway_ratio": pytest.approx(1.25), "omega_s": 4.0},
        "te_harmonic": {"order": 6.0},
    }


def test_against_engine_same_model_same_parameters():
    """Same drive, no effect, no nuisance: both agree within a small part of the sensors' noise, not bit for bit."""
    rng = np.random.default_rng(5)
    rig = draw_rig(rng, Recipe(("null",), {}, 5))
    rig = replace(rig, plant=rig.plant._replace(T_c=0.0))
    p, run = rig.plant, next(r for r in rig.runs if r.closed)
    traces = dict(zip(stepping.TRACES, simulate(rig, Drive(p, sensors.SOUND), run, rng), strict=True))
    t = np.arange(run.reference.size) * stepping.GRID
    model = hdfast.Model(orders=list(p.te_order))
    names = [n for n in hdfast.params(model).names if n.startswith("te_")]
    parts = zip(
        [n for n in names if "cos" in n], [n for n in names if "sin" in n], p.te_amplitude, p.te_phase, strict=True
    )
    row = {"k5": 0.0, "B_ml": 0.0, "phi_max": rig.windup_range, "B_m": p.B_m, "k3": p.k3, "B_sp": p.B_sp}
    row |= {"ratio": p.ratio, "J_m": p.J_r + p.J_w, "J_l": p.J_f + p.J_p, "B_l": p.B_l, "k1": p.k1}
    for cosine, sine, amplitude, phase in parts:
        row |= {cosine: amplitude * np.cos(phase), sine: -amplitude * np.sin(phase)}
    seen = {"t": t[::2], "motor_angle": traces["motor_angle"][::2], "load_torque": run.load[::2]}
    scenario = hdfast.Scenario.replay(seen, input="motor_motion")
    at = t[40:-40:4]
    found = hdfast.simulate(row, model=model, scenario=scenario, t_eval=at, signals=["theta_l", "tau_m"])
    angle = np.asarray(found["theta_l"]) - np.interp(at, t, traces["load_angle"])
    torque = np.asarray(found["tau_m"]) - np.interp(at, t, traces["motor_torque"])
    assert 0.0 < np.std(angle) < 0.2 * rig.chain.noise[1].pink
    assert 0.0 < abs(np.mean(torque)) < 0.1 * rig.chain.noise[2].pink


@pytest.fixture(scope="module")
def bench():
    """A quiet bench with everything on it, linearised."""
    rng = np.random.default_rng(12)
    recipe = Recipe(
        ("single",),
        dict.fromkeys(("stribeck_friction",), 3.0),
        12,
        Bench(warm=True, noise=0.05, seconds=(2.0, 3.0), recordings=(4, 4)),
    )
    rig = draw_rig(rng, recipe)
    rig = replace(rig, has_output_torque=False)
    bare = Drive(rig.plant, sensors.SOUND)
    motions = [motion(simulate(rig, bare, run, rng), run) for run in rig.runs]
    return rig, linearise(rig, bare, motions, rng)


@pytest.mark.long
def test_exact_effects_are_sized_in_the_noise_of_the_rig_that_is_recorded(bench):
    """A rig whose effects come out too small gets noisier sensors, three times at most."""
    rig, lin = bench
    recipe = Recipe(("single",), {"cogging": 0.01}, 12, Bench())
    noisier, used, _ = sized_within_limits(rig, lin.drive, lin.motions, recipe, np.random.default_rng(5))
    assert noisier.chain != rig.chain
    assert used.rig is noisier


def test_exact_a_drive_at_rest_stays_there_on_an_imposed_motion(bench):
    """Also one whose load a weight holds out of the balance of the drive without it."""
    rig, lin = bench
    still = np.zeros(2000)
    rest = Motion(still + 1.0, still, still, still, still + 20.0)
    weight = EFFECTS["gravity_unbalance"].on(lin.drive, 8.0, {"psi_gravity": 1.2})
    for channel in next(responses(rig, weight, [rest])):
        assert np.ptp(channel) < 1e-9 * max(float(np.abs(channel).max()), 1.0)


@pytest.mark.long
def test_against_single_sizes_a_rival_is_taken_at_its_best(bench):
    """Creep looks more like hysteresis where it is small: a large one shifts the resonance."""
    _, lin = bench
    slips, creeps = sketch(lin, "hysteresis", 3.0, np.random.default_rng(2)), EFFECTS["viscoelastic"]
    left, single = lin.left(lin.signature(slips.on(lin.drive))[0]), []
    for size in (0.1, 1.0):
        own = lin.left(lin.signature(creeps.on(lin.drive, size * creeps.typical, {"tau_v": 0.5}))[0])
        single.append(abs(own @ left) / np.linalg.norm(own) / np.linalg.norm(left))
    best = next(one["abs_cos"] for one in rivals(lin, left, [slips]) if one["id"] == creeps.id)
    assert best == pytest.approx(max(single), abs=0.05)
    assert min(single) < best - 0.1


def test_against_dense_least_squares_the_refit_with_priors(bench):
    _, lin = bench
    signature = lin.signature(follow(lin, sketch(lin, "te_harmonic", 3.0, np.random.default_rng(1))).on(lin.drive))[0]
    count = lin.columns.shape[1]
    stacked = np.vstack([lin.columns, np.eye(count)])
    exact = np.linalg.lstsq(stacked, np.append(signature, np.zeros(count)), rcond=None)[0]
    np.testing.assert_allclose(lin.shift(signature), exact, atol=1e-8 * np.max(np.abs(exact)))
    np.testing.assert_allclose(lin.left(signature), signature - lin.columns @ exact, atol=1e-6)


@pytest.mark.long
def test_against_least_squares_the_refit_of_the_moved_plant(bench):
    """A softer windup shifts the resonance: the refit must follow it to where scipy's own steps end."""
    _, lin = bench
    full = lin.drive._replace(plant=lin.drive.plant._replace(k1=0.6 * lin.drive.plant.k1))
    signature, _ = lin.signature(full)

    def remaining(shift):
        plant = lin.drive._replace(plant=moved(lin.rig, lin.drive.plant, shift))
        rest = lin.columns[:, plants:] @ shift[plants:]
        return np.append(signature - lin.signature(plant)[0] - rest, shift)

    plants = len(lin.rig.sigma) + 2 * lin.drive.plant.te_order.size
    best = least_squares(remaining, np.zeros(len(lin.names)), x_scale="jac", max_nfev=20)
    found = lin.refit(full)
    linear = np.sum(lin.left(signature) ** 2) + np.sum(lin.shift(signature) ** 2)
    cost = np.sum(found.left**2) + np.sum(found.shift**2)
    assert cost < 2.0 * best.cost + 1.0
    assert cost != pytest.approx(linear, rel=0.5)


@pytest.mark.long
def test_exact_detectable_amplitudes_have_the_stated_length(bench):
    _, lin = bench
    rng = np.random.default_rng(3)
    for effect_id in ("te_harmonic", "torque_ripple", "load_side_friction"):
        sized = follow(lin, sketch(lin, effect_id, 2.0, rng))
        left = swallowed(lin, [replace(sized, multiple=1.0)]).left
        assert np.linalg.norm(left) / np.sqrt(lin.inflation(left)) == pytest.approx(4.5, rel=0.05)


@pytest.mark.parametrize(
    "effect_id",
    [pytest.param(e, marks=[pytest.mark.long] * (e != "backlash")) for e in TWELVE if e != "coulomb_friction"],
)
def test_exact_at_eight_times_detectable_a_channel_moves_beyond_its_noise(bench, effect_id):
    """Acceptance (c): 36 standard deviations of the matched filter if linear; friction that holds saturates."""
    _, lin = bench
    sized = follow(lin, sketch(lin, effect_id, 8.0, np.random.default_rng(4)))
    left = swallowed(lin, [sized]).left
    assert np.linalg.norm(left) / np.sqrt(lin.inflation(left)) > 3.0 * 4.5


@pytest.mark.long
def test_exact_a_followed_refit_swallows_what_one_from_elsewhere_swallows(bench):
    """Hysteresis beside a resonance: refits that start at other stiffnesses end where no less is left."""
    _, lin = bench
    sized = follow(lin, sketch(lin, "hysteresis", 4.0, np.random.default_rng(4)))
    followed, full = swallowed(lin, [sized]), sized.on(lin.drive)
    stiffer = np.zeros(len(lin.names))
    stiffer[lin.names.index("k1")] = 3.0
    for start in (followed.shift, stiffer, -stiffer):
        assert lin.refit(full, [start]).cost >= 0.9 * followed.cost


@pytest.mark.long
def test_exact_a_late_load_sensor_looks_like_a_filtered_one_wherever_the_refit_moves_the_drive(bench):
    """They differ by the square of a millisecond; against a drive that has not moved, the low-pass would not fit."""
    _, lin = bench
    sized = follow(lin, sketch(lin, "sensor_delay", 8.0, np.random.default_rng(4)))
    refit = swallowed(lin, [sized])
    closest = likeness(lin, refit, [sized], [f"{k}" for k in range(4)])["closest_rival"]
    late, filtered = (
        lin.left(lin.signature(EFFECTS[effect_id].on(lin.drive, sized.amplitude, {}))[0])
        for effect_id in ("sensor_delay", "sensor_lowpass")
    )
    assert np.max(np.abs(refit.shift)) > 1.0
    assert np.linalg.norm(late - filtered) < 0.1 * np.linalg.norm(late)
    assert closest["id"] == "sensor_lowpass"
    assert closest["abs_cos"] > 0.98


def test_exact_small_effects_are_sized_by_a_linear_refit(bench):
    _, lin = bench
    sized = sketch(lin, "hysteresis", 0.2, np.random.default_rng(4), at=0.2)
    left = lin.left(lin.signature(sized.on(lin.drive))[0])
    assert length(lin, left) == pytest.approx(0.2, rel=0.05)


def test_exact_nuisance_sizes():
    rng = np.random.default_rng(6)
    drawn = [nuisance.draw_sizes(rng, count) for count in (2, 3, 4) for _ in range(400)]
    flat = np.concatenate(drawn)
    assert flat.min() >= 0.05
    assert flat.max() <= 0.3
    assert max(np.linalg.norm(x) for x in drawn) <= 0.6
    twos = np.concatenate([x for x in drawn if len(x) == 2])
    counts, _ = np.histogram(twos, 5, (0.05, 0.3))
    assert counts.min() > 0.75 * counts.mean()


def test_exact_generator_imports_nothing_of_the_tool():
    for path in Path(generator.__file__).parent.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            names += [node.module] if isinstance(node, ast.ImportFrom) else []
            assert all(n.startswith("hdfast.proof.generator") for n in names if n.startswith("hdfast")), path


def test_exact_diagnosis_imports_nothing_of_the_generator():
    modules = list((Path(hdfast.__file__).parent / "diagnosis").rglob("*.py"))
    assert modules
    for path in modules:
        assert "hdfast.proof" not in path.read_text(), path


def test_exact_mix_of_the_first_release():
    recipes = strata.plan(300, 0)
    count = {
        k: sum(k in r.kinds for r in recipes)
        for k in ("null", "single", "set", "sensor_only", "outside", "undecidable")
    }
    assert count == {"null": 100, "single": 120, "set": 30, "sensor_only": 10, "outside": 20, "undecidable": 20}
    assert sum("absorbed" in r.kinds for r in recipes) >= 40
    assert sum(any(k.startswith("masked") for k in r.kinds) for r in recipes) >= 30
    assert sum(r.bench.motor_only for r in recipes) >= 60
    assert {i: sum(r.kinds[0] == "single" and i in r.effects for r in recipes) for i in TWELVE} == dict.fromkeys(
        TWELVE, 10
    )
    assert all(i in EFFECTS for r in recipes for i in r.effects)


def test_exact_torque_above_half_the_recorders_rate_is_not_counted():
    t = np.arange(4000) * COARSE
    chain = draw_chain(np.random.default_rng(3), Bench(fast=True))
    rig = replace(draw_rig(np.random.default_rng(3), Recipe(("null",), {}, 3)), chain=chain)
    slow, fast = (np.cos(2.0 * np.pi * frequency * t) for frequency in (10.0, 98.0))
    middle = slice(1000, 3000)
    np.testing.assert_allclose(told_by_motion(rig, slow + fast)[middle], slow[middle], atol=0.02)


def test_exact_lines_of_a_fast_drive_pass_half_the_recorders_rate():
    for seed in range(20):
        rig = draw_rig(np.random.default_rng(seed), Recipe(("single",), {"te_harmonic": 3.0}, seed, Bench(fast=True)))
        fastest = max(np.max(np.abs(run.reference)) for run in rig.runs if run.closed) / (2.0 * np.pi)
        assert 6.0 * fastest > 0.5 * rig.chain.rate


@pytest.fixture(scope="module", params=[False, True], ids=["both sides", "motor only"])
def case(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp("case") / "case"
    bench = Bench(motor_only=request.param, seconds=(1.0, 1.5), recordings=(4, 4))
    recipe = Recipe(("single",), {"torque_ripple": 3.0}, 21, bench)
    return recipe, folder, build(recipe, folder)


def test_exact_a_case_meets_the_contract(case):
    recipe, folder, (label, *_) = case
    campaign = load_campaign(folder / "campaign.toml")
    roles = [r["role"] for r in campaign.data["recording"]]
    assert "heldout" in roles
    assert roles.count("fit") >= 3
    for recording in campaign.recordings:
        assert ("load_angle" in recording.columns) is not recipe.bench.motor_only
        assert 0.9 < np.ptp(recording.columns["t"]) < 1.6
    assert label["effects"][0]["amplitude_over_mda"] == pytest.approx(3.0)
    assert {n["id"] for n in label["nuisance"]}.isdisjoint({"torque_ripple"})
    assert 2 <= len(label["nuisance"]) <= 4


def test_exact_a_case_tells_nothing(case):
    _, folder, _ = case
    text = (folder / "campaign.toml").read_text().lower()
    for word in ("ripple", "nuisance", "seed", "mda", "detect", 'kind = "single'):
        assert word not in text
    stated = load_campaign(folder / "campaign.toml").data["drive"]
    assert stated["phi_max"] == pytest.approx(200.0 / stated["k1"]["value"], rel=1e-3)


def test_exact_the_same_seed_gives_the_same_bytes(case, tmp_path):
    recipe, folder, built = case
    again = build(recipe, tmp_path / "again")
    assert json.dumps(again.label) == json.dumps(built.label)
    first, second = (checksums(f) for f in (folder, tmp_path / "again"))
    assert first == second


ASKED = {
    "manoeuvre": {
        "start_angle_rad": 2.0,
        "segments": [
            {"speed_rad_s": 12.0, "ramp_s": 0.2, "hold_s": 0.8},
            {"speed_rad_s": -6.0, "ramp_s": 0.4, "hold_s": 0.6},
        ],
    },
    "limits": {"speed_rad_s": 12.0, "low_angle_rad": -5.0, "high_angle_rad": 15.0},
}


def test_exact_what_is_asked_for_is_recorded_beside_the_others(case, tmp_path):
    _, folder, built = case
    for name in ("one", "again"):
        move = further.asked(ASKED)
        further.add(folder, tmp_path / name, built, move, np.random.default_rng(1))
    assert checksums(tmp_path / "one") == checksums(tmp_path / "again")
    assert checksums(folder).items() - checksums(tmp_path / "one").items() == {
        ("campaign.toml", checksums(folder)["campaign.toml"])
    }
    before, after = (load_campaign(each / "campaign.toml") for each in (folder, tmp_path / "one"))
    assert len(after.recordings) == len(before.recordings) + 1
    added = after.recordings[-1]
    assert after.data["recording"][-1]["role"] == "fit"
    t, angle = added.columns["t"], added.columns["motor_angle"]
    assert angle[0] == pytest.approx(2.0, abs=0.1)
    for begin, end, speed in ((0.5, 0.9, 12.0), (1.7, 1.9, -6.0)):
        held = (t > begin) & (t < end)
        assert np.polyfit(t[held], angle[held], 1)[0] == pytest.approx(speed, rel=0.1)


def test_exact_a_motion_at_random_keeps_to_the_limits_of_the_one_asked_for():
    for seed in range(20):
        speed, start = further.drawn(ASKED, np.random.default_rng(seed))
        angle = start + np.cumsum(speed) * stepping.GRID
        assert speed.size == further.asked(ASKED)[0].size
        assert np.abs(speed).max() <= 12.0 * (1.0 + 1e-9)
        assert angle.min() >= -5.0 - 0.01
        assert angle.max() <= 15.0 + 0.01


@pytest.mark.parametrize(
    "broken",
    [
        None,
        {},
        {"segments": []},
        ASKED | {"manoeuvre": {"start_angle_rad": 0.0, "segments": []}},
        ASKED | {"manoeuvre": {"segments": ASKED["manoeuvre"]["segments"]}},
        ASKED | {"manoeuvre": ASKED["manoeuvre"] | {"segments": [{"speed_rad_s": 1.0, "ramp_s": 0.0, "hold_s": 61.0}]}},
        ASKED | {"manoeuvre": ASKED["manoeuvre"] | {"segments": [{"speed_rad_s": 1.0, "ramp_s": 0.0, "hold_s": 1e-5}]}},
        ASKED | {"manoeuvre": ASKED["manoeuvre"] | {"segments": [{"speed_rad_s": 1.0, "ramp_s": "1", "hold_s": 1.0}]}},
        ASKED | {"limits": ASKED["limits"] | {"speed_rad_s": float("nan")}},
        ASKED | {"limits": ASKED["limits"] | {"speed_rad_s": 1e9}},
        ASKED | {"limits": ASKED["limits"] | {"low_angle_rad": 3.0, "high_angle_rad": 2.0}},
    ],
)
def test_exact_what_tells_no_motion_is_not_run(broken):
    assert further.runnable(ASKED)
    assert not further.runnable(broken)


def test_exact_plant_and_sensor_faults_share_no_name():
    assert not set(Plant._fields) & set(sensors.Faults._fields)
    assert all((e.amplitude in Plant._fields) != (e.amplitude in sensors.Faults._fields) for e in EFFECTS.values())


def test_exact_what_friction_holds_at_standstill_is_no_evidence(bench):
    rig, lin = bench
    held = [
        [1.0 - moving(rig, one), *(np.zeros_like(values) for values in base[1:])]
        for one, base in zip(lin.motions, lin.base, strict=True)
    ]
    assert any(one[0].any() and not one[0].all() for one in held)
    assert not whiten(rig, lin.motions, lin.filters, held).any()


def test_exact_a_zero_that_no_campaign_states_is_no_evidence(bench):
    rig, lin = bench
    steps = [[np.full_like(values, 0.1 * np.ptp(values)) for values in base] for base in lin.base]
    whitened = whiten(rig, lin.motions, lin.filters, steps)
    assert np.linalg.norm(lin.left(whitened)) < 1e-2 * np.linalg.norm(whitened)
    assert np.abs(lin.shift(whitened)).max() < 0.05


def test_exact_error_of_the_true_structure_below_a_corner_is_that_share_of_white_noise():
    noise = {"motor_angle": 0.0, "load_angle": 1e-5, "motor_torque": 2e-2, "output_torque": 0.5}
    found = true_structure(noise)[1]["oracle_heldout"]
    assert set(found) <= {"motor_torque", "te", "output_torque"}
    for name, level in (("motor_torque", 2e-2), ("te", 1e-5)):
        corner, rms = np.array(found[name])[-6:].T
        assert corner[-1] == 500.0
        passed = [np.mean(low_passed(f) ** 2) * 500.0 if name == "motor_torque" else f for f in corner]
        np.testing.assert_allclose(rms, level * np.sqrt(2.0 * np.array(passed) * stepping.GRID), rtol=0.08)


def test_exact_noise_of_the_motor_angle_reaches_the_torque_differentiated_twice():
    rig, found = true_structure({"motor_angle": 1e-6, "load_angle": 0.0, "motor_torque": 0.0, "output_torque": 0.0})
    found = found["oracle_heldout"]
    corner, rms = np.array(found["motor_torque"])[-6:].T
    passed = [np.mean((low_passed(f) * (2.0 * np.pi * WHOLE) ** 2) ** 2) * 500.0 for f in corner]
    level = (rig.plant.J_r + rig.plant.J_w) * 1e-6
    np.testing.assert_allclose(rms, level * np.sqrt(2.0 * np.array(passed) * stepping.GRID), rtol=0.08)


WHOLE = np.arange(0.0, 500.0, 0.01)


def low_passed(corner):
    return 1.0 / (1.0 + (WHOLE / corner) ** 8)


def true_structure(noise):
    """A rig of 1 kHz, and the error of its true structure with white noise of these levels."""
    rng = np.random.default_rng(7)
    rig = draw_rig(rng, Recipe(("null",), {}, 5))
    rig = replace(rig, chain=rig.chain._replace(averaged=True, rate=1000.0))
    t = np.arange(80_000) * stepping.GRID
    clean = {
        name: np.sin(2.0 * np.pi * 2.0 * t) * (rig.plant.ratio if name == "motor_angle" else 1.0) for name in noise
    }
    clean["load_angle"] = 0.5 * clean["load_angle"]
    noisy = {name: clean[name] + noise[name] * rng.standard_normal(t.size) for name in noise}
    noisy["motor_torque"] = 1.03 * noisy["motor_torque"] + 0.2
    missed = [[np.zeros(2000) for _ in channels(rig)]]
    return rig, oracle(rig, [clean], [noisy], missed)


def test_exact_scale_and_zero_of_the_torque_reading_are_no_error_of_the_true_structure():
    _, found = true_structure(dict.fromkeys(sensors.CHANNELS, 0.0))
    assert found["oracle_heldout_nrmse"] < 1e-9


def test_exact_what_a_refit_misses_adds_to_the_noise_as_powers_do():
    rig = draw_rig(np.random.default_rng(7), Recipe(("null",), {}, 5, Bench(motor_only=True)))
    rig = replace(rig, chain=rig.chain._replace(averaged=True, rate=1000.0))
    t = np.arange(8000) * stepping.GRID
    clean = dict.fromkeys(sensors.CHANNELS, np.sin(2.0 * np.pi * 2.0 * t))
    noisy = clean | {"motor_torque": clean["motor_torque"] + 1e-3 * np.random.default_rng(1).standard_normal(t.size)}
    missed = [[3e-3 * np.sin(2.0 * np.pi * 5.0 * np.arange(500) / 250.0)]]
    found = oracle(rig, [clean], [noisy], missed)
    (error, noise), corner = (
        (np.array(found[key]["motor_torque"])[:, 1] for key in ("oracle_heldout", "noise_heldout")),
        np.array(found["noise_heldout"]["motor_torque"])[:, 0],
    )
    added = np.where(corner >= 5.0, 3e-3 / np.sqrt(2.0), 0.0)
    np.testing.assert_allclose(error, np.hypot(noise, added), rtol=1e-3)


def test_exact_a_refit_without_noise_finds_drive_and_size(bench):
    """The effect is half as large again as stated, the torque reads 3 % too much, and the data sheet is wrong."""
    rig, lin = replace(bench[0], torque_scale=0.03), bench[1]
    effect = follow(lin, sketch(lin, "torque_ripple", 8.0, np.random.default_rng(4)))
    full = together(lin.drive, [effect], 1.5)
    rows = [simulate(rig, full, run, np.random.default_rng(k)) for k, run in enumerate(rig.runs)]
    clean = [sensors.clean(row, full.faults) for row in rows]
    noisy = [one | {"motor_torque": 1.03 * one["motor_torque"]} for one in clean]
    motions = [motion(row, run) for row, run in zip(rows, rig.runs, strict=True)]
    stated = refitted(replace(lin, rig=rig), [], effect.on(lin.drive), clean, noisy)
    found = refitted(replace(lin, rig=rig), [effect], full, clean, noisy)
    assert found.scale == pytest.approx(1.03, abs=0.003)
    for one, least, most in ((found, 0.0, 0.1), (stated, 0.3, np.inf)):
        missed = np.concatenate([channels[0] for channels in one.misses(rig, full, motions)])
        assert least < np.std(missed) / lin.level[0] < most
