"""Samples: the states are interpolated only as far as the signals need them, for all lanes at once."""

from __future__ import annotations

import hdfast
import numpy as np
import pytest

SIGNALS = ("theta_m", "omega_m", "theta_l", "omega_l", "te", "windup", "tau_m")
GRID = np.sort(np.r_[np.linspace(0.0, 1.5, 61), 0.3, 0.3, 0.9, np.random.default_rng(0).uniform(0.0, 1.5, 80)])
MODELS = {
    "two inertias": hdfast.Model(),
    "one inertia": hdfast.Model(base="one_inertia"),
    "dry friction": hdfast.Model(terms=["coulomb_friction"]),
}


def sampled(signals, model, taken=slice(None), **options):
    rng = np.random.default_rng(3)
    scenario = hdfast.Scenario.start_stop(t_end=1.5, t_off=0.9)
    rows = {"J_m": 2.5e-4 * rng.uniform(0.8, 1.2, 20)[taken], "omega_set": rng.uniform(2.0, 30.0, 20)[taken]}
    return hdfast.sweep(rows, model=model, scenario=scenario, t_eval=GRID, signals=signals, metrics=[], **options)


@pytest.mark.parametrize("method", ["dop853", "tsit5"])
@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
def test_exact_a_signal_does_not_depend_on_what_else_is_sampled(model, method):
    together = sampled(SIGNALS, model, method=method)
    assert together.finished.all()
    for signal in SIGNALS:
        alone = sampled([signal], model, method=method)
        assert np.array_equal(alone.samples[signal], together.samples[signal]), signal


@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
def test_exact_nor_on_the_rows_beside_it(model):
    """Signals that take the equations are observed together with those of other rows, at times of their own."""
    together = sampled(SIGNALS, model, threads=1)
    for row in (0, 7, 19):
        alone = sampled(SIGNALS, model, [row])
        for signal in SIGNALS:
            assert np.array_equal(alone.samples[signal][0], together.samples[signal][row]), (row, signal)


def test_exact_nor_do_its_derivatives():
    together = sampled(SIGNALS, MODELS["two inertias"], sensitivities=["J_m"])
    for signal in ("te", "omega_l"):
        alone = sampled([signal], MODELS["two inertias"], sensitivities=["J_m"])
        own, other = (result.sample_sensitivities[signal] for result in (alone, together))
        assert np.array_equal(own, other), signal


def test_exact_samples_of_a_metric_beside_those_of_a_user():
    """Orders of the transmission error are fitted to samples of their own between the user's."""
    model = MODELS["two inertias"]
    scenario = hdfast.Scenario.start_stop(t_end=3.0, t_off=2.5)
    plain = hdfast.sweep({"omega_set": 20.0}, model=model, scenario=scenario, metrics=["order_2"])
    both = hdfast.sweep(
        {"omega_set": 20.0}, model=model, scenario=scenario, metrics=["order_2"], t_eval=GRID, signals=["omega_l"]
    )
    assert np.isfinite(plain.metrics["order_2"]).all()
    assert np.array_equal(plain.metrics["order_2"], both.metrics["order_2"])
