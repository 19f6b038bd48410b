"""Recordings of real machines with effects put in, and with nothing put in, before the diagnosis."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

import hdfast
import numpy as np
import pytest
from anchors import emps, ur10e
from hdfast.proof import run
from hdfast.proof.bridge import cases, controls
from hdfast.proof.bridge.injections import INJECTIONS
from hdfast.proof.bridge.machine import Machine, calibrated

PATIENCE_S = 900.0
MACHINES: dict[str, Callable[[Path], Path]] = {
    "ur10e_j1": partial(ur10e.write, joint=1),
    "ur10e_j2": partial(ur10e.write, joint=2),
    "ur10e_j4": partial(ur10e.write, joint=4),
    "emps": emps.write,
}


@pytest.fixture(scope="module")
def joint(tmp_path_factory: pytest.TempPathFactory) -> Machine:
    """The vertical axis of a robot: no weight turns about it."""
    return calibrated(MACHINES["ur10e_j1"](tmp_path_factory.mktemp("joint")))


def verdict(folder, machine, recordings):
    cases.write(folder, machine, recordings, np.random.default_rng(1))
    found = hdfast.diagnose(folder / "campaign.toml")
    return found.verdict, {effect["effect"] for effect in found.effects}


def test_exact_random_phases_of_a_real_residual_are_no_claim(joint, tmp_path):
    """A line of 0.31 Hz holds a quarter of its power; in the held-out recording it has another phase."""
    made = controls.shuffled(joint, np.random.default_rng(2))
    told, named = verdict(tmp_path / "case", joint, made)
    assert told in ("no_evidence", "undecided")
    assert named == set()


@pytest.mark.long
def test_exact_a_weight_put_on_a_vertical_axis_is_found(joint, tmp_path):
    weight = next(one for one in INJECTIONS if one.effect == "gravity_unbalance")
    made, _ = cases.injected(joint, weight, 8.0, np.random.default_rng(3))
    told, named = verdict(tmp_path / "case", joint, made)
    assert told == "found"
    assert "gravity_unbalance" in named
    assert named <= {"gravity_unbalance", "nonlinear_viscous"}, "the joint's own drag grows slower than its speed"


@pytest.mark.long
def test_regress_real_joints_and_a_carriage(tmp_path):
    """The marks, no claim on a control and 80 % of the effects named, are missed; docs/proof.md has the figures."""
    campaigns = [write(tmp_path / name) for name, write in MACHINES.items()]
    proof = run.prove_real(tmp_path / "set", campaigns, seed=0, workers=2, step=lambda *_: None, limit=PATIENCE_S)
    outcomes = {(case["kind"][1], *case["truth"], case["outcome"]) for case in proof["cases"]}
    for control in ("as_recorded", "shuffled", "transplanted"):
        assert (control, "wrong") not in outcomes
    for effect in ("gravity_unbalance", "position_dependent_friction", "nonlinear_viscous"):
        assert ("semi_synthetic", effect, "right") in outcomes
