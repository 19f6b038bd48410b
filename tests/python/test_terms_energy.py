"""The balance of energy with any set of terms."""

from __future__ import annotations

import hdfast
import numpy as np
import pytest
from drives import SCENARIO, parameters
from termed import COMBINATIONS, LOAD, RUN, VALUES, torque_steps, with_company

METRICS = ["energy_in", "loss_terms", "loss_motor", "loss_wave_generator", "energy_residual"]
# terms that may lessen the viscous drag, and with it what the audit books on B_m and B_ml
LESSEN = {"wear_run_in", "thermal_viscous", "asymmetric_friction"}
RIGID = {term.id for term in hdfast.terms() if "one_inertia" in term.bases}


def audit(terms, base, scenario, **options):
    on, values = with_company(terms)
    row = {name: value for name, value in parameters(**values).items() if name not in SCENARIO}
    model = hdfast.Model(base, terms=on)
    run = hdfast.simulate(row, model=model, scenario=scenario, metrics=METRICS, **options)
    assert run.status == "finished", run.message
    return run.metrics


@pytest.mark.parametrize("base", ["two_inertia", "one_inertia"])
@pytest.mark.parametrize("terms", [[term] for term in VALUES] + COMBINATIONS, ids="+".join)
def test_exact_energy_audit_with_terms(terms, base):
    """What motor and load put in is stored or lost, and no set of terms loses less than nothing."""
    terms = [term for term in terms if base == "two_inertia" or term in RIGID]
    if not terms:
        pytest.skip("nothing of it on a rigid gear")
    found = audit(terms, base, torque_steps(RUN, LOAD), rtol=1e-8)
    assert found["energy_residual"] < 3e-6
    lost = found["loss_terms"]
    if LESSEN & set(terms):
        lost += found["loss_motor"] + found["loss_wave_generator"]
    assert lost >= -1e-9 * abs(found["energy_in"])


@pytest.mark.parametrize("base", ["two_inertia", "one_inertia"])
@pytest.mark.parametrize(
    ("term", "values"),
    [
        ("wear_run_in", {}),
        ("thermal_viscous", {"ambient_temperature": 35.0}),
        ("asymmetric_friction", {"eps_B": -0.15}),
    ],
)
def test_exact_less_drag_of_the_slip_drives_nothing(term, values, base):
    """B_ml acts between both shafts: with ratio 1 and s = 1 they do not slip, and B_m alone takes their energy."""
    speed, inertias, drag = 8.0, {"J_m": 3e-4, "J_l": 1e-3}, {"B_m": 1e-4, "B_l": 0.0, "B_ml": 3e-3}
    run = hdfast.simulate(
        {"ratio": 1.0, "s": 1.0, **inertias, **drag, **values},
        model=hdfast.Model(base, terms=[term], orders=[]),
        scenario=hdfast.Scenario.torque_profile([0.0, 6.0], [0.0, 0.0]),
        initial_state={"two_inertia": [0.0, speed, 0.0, speed], "one_inertia": [0.0, speed]}[base],
        t_eval=[0.0, 6.0],
        signals=["omega_m"],
        metrics=[*METRICS, "loss_load", "loss_mesh"],
    )
    before, after = 0.5 * sum(inertias.values()) * run["omega_m"] ** 2
    lost = sum(run.metrics[name] for name in run.metrics if name.startswith("loss"))
    assert 0.0 < after < before
    np.testing.assert_allclose(lost, before - after, rtol=1e-5)


def test_exact_energy_audit_of_an_imposed_motion():
    terms = ["coulomb_friction", "load_side_friction", "hysteresis", "base_compliance", "torque_gain"]
    t = np.linspace(0.0, 1.0, 201)
    scenario = hdfast.Scenario.motion(t, 5.0 * np.sin(6.0 * t), torque=(t, 0.1 * t), load=LOAD)
    found = audit(terms, "two_inertia", scenario, rtol=1e-8)
    assert found["energy_residual"] < 3e-6
    assert found["loss_terms"] > 0.0


def test_exact_heat_of_a_stopped_drive():
    """A drive at rest again, all springs relaxed, has lost in dampers and terms all that was put in."""
    names = [*METRICS, "loss_load", "loss_mesh"]
    run = hdfast.simulate(
        {"te_scale": 0.0, "T_c": 0.04},
        model=hdfast.Model(terms=["coulomb_friction"]),
        scenario=hdfast.Scenario.start_stop(t_end=3.0),
        metrics=names,
        rtol=1e-8,
    )
    lost = sum(run.metrics[name] for name in names if name.startswith("loss"))
    assert run.metrics["loss_terms"] > 0.1 * run.metrics["energy_in"]
    np.testing.assert_allclose(lost, run.metrics["energy_in"], rtol=2e-6)


@pytest.mark.parametrize("method", ["tsit5", "dop853"])
@pytest.mark.parametrize("rtol", [1e-4, 1e-6, 1e-9])
def test_exact_energies_along_an_imposed_motion_of_a_rigid_gear(method, rtol):
    """Friction that varies over the turn takes its level times the angle and a wave; no state limits the step."""
    level, ripple, speed, order, end = 0.02, 0.4, 30.0, 3.0, 2.0
    t = np.linspace(0.0, end, 5)
    run = hdfast.simulate(
        {"T_c": level, "friction_ripple": ripple, "position_dependent_friction_order": order, "psi": 0.0},
        model=hdfast.Model("one_inertia", orders=[], terms=["coulomb_friction", "position_dependent_friction"]),
        scenario=hdfast.Scenario.motion(t, speed * t),
        metrics=["loss_terms", "energy_residual"],
        method=method,
        rtol=rtol,
    )
    angle = speed * end
    lost = level * (angle + ripple * np.sin(order * angle) / order)
    assert run.metrics["loss_terms"] == pytest.approx(lost, rel=3.0 * rtol)
    assert run.metrics["energy_residual"] < 1e-9


@pytest.mark.parametrize("base", ["one_inertia", "two_inertia"])
@pytest.mark.parametrize("rtol", [1e-6, 1e-9])
def test_against_short_steps_energies_along_a_motion_to_and_fro(base, rtol):
    """Where the motor turns back the power of its friction has a kink."""
    t = np.linspace(0.0, 2.0, 12)
    options = {
        "model": hdfast.Model(base, terms=["stribeck_friction"]),
        "scenario": hdfast.Scenario.motion(t, 8.0 * t + 7.0 * np.sin(4.0 * t), load=8.0),
        "metrics": ["loss_terms", "energy_in"],
    }
    right = hdfast.sweep({}, rtol=1e-9, max_step=2e-5, **options)
    found = hdfast.sweep({}, rtol=rtol, **options)
    for metric in options["metrics"]:
        np.testing.assert_allclose(found[metric], right[metric], rtol=30.0 * rtol)
