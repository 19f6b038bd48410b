"""A campaign that is diagnosed within a second: three short recordings and a library of a few effects."""

from __future__ import annotations

import hdfast
import numpy as np
from hdfast.diagnosis import session

DRIVE = {"J_m": 3e-4, "J_l": 0.5, "B_m": 6e-4, "B_ml": 6e-4, "B_l": 0.5, "B_sp": 20.0, "k1": 31020.0}
HEAD = "\n".join(
    [
        'title = "A <small> campaign"',
        "[drive]",
        "ratio = 121",
        *(f"{name} = {value}" for name, value in DRIVE.items()),
        "[kinematic_error]",
        "orders = [2]",
        "cos = [7e-5]",
        "sin = [5e-5]",
        "sigma = 1e-5",
        "[sensors]",
        "motor_angle = { resolution = 4.8e-5 }",
        "load_angle = { resolution = 6e-6 }",
        "motor_torque = { noise = 2e-3 }",
    ]
)
LIBRARY = ("coulomb_friction", "nonlinear_viscous", "encoder_eccentricity")
MARKS = np.array([0.0, 0.2, 0.5, 1.2, 1.6, 2.2, 2.5, 3.0])
SHAPE = np.array([0.0, 0.0, 1.0, 1.0, -0.6, -0.6, 0.0, 0.0])


def write(folder, terms=(), parameters=None, angle_noise=0.0, orders=(2,), clock=None):
    """Campaign file of three recordings to fit and one to prove on, of a drive with further terms or orders.

    Each is taken at the times that `clock` makes of a generator; by default every 2 ms. A weight has stopped swinging
    before.
    """
    rng = np.random.default_rng(1)
    lines = [HEAD]
    model = hdfast.Model(terms=list(terms), orders=list(orders))
    values = DRIVE | {"te_cos_2": 7e-5, "te_sin_2": 5e-5} | (parameters or {})
    settled = 2.0 if "gravity_unbalance" in terms else 0.0
    for number, (speed, role) in enumerate(((20.0, "fit"), (50.0, "fit"), (8.0, "fit"), (-35.0, "heldout"))):
        t = np.arange(0.0, 3.0, 0.002) if clock is None else clock(rng)
        marks = np.append(0.0, MARKS[1:] + settled)
        scenario = hdfast.Scenario.speed_profile(marks, speed=speed * SHAPE, t_end=3.0 + settled)
        run = hdfast.sweep(
            values,
            model=model,
            scenario=scenario,
            t_eval=t + settled,
            signals=["theta_m", "theta_l", "tau_m"],
            metrics=[],
        )
        angle, load, torque = (run.samples[name][0] for name in ("theta_m", "theta_l", "tau_m"))
        angle = angle + angle_noise * rng.standard_normal(len(t))
        np.savez(
            folder / f"r{number}.npz",
            t=t,
            motor_angle=np.round(angle / 4.8e-5) * 4.8e-5,
            load_angle=np.round(load / 6e-6) * 6e-6,
            motor_torque=torque + 2e-3 * rng.standard_normal(len(t)),
        )
        lines.append(f'[[recording]]\nfile = "r{number}.npz"\nrole = "{role}"\ngroup = "{number}"')
    path = folder / "campaign.toml"
    path.write_text("\n".join(lines) + "\n")
    return path


def write_without_in_held_out(folder, terms, parameters, orders=(2,), always=((), None)):
    """Campaign file of a drive with terms and orders that are in the recordings to fit and not in the one to prove on.

    That one is of a drive with the terms and parameters that are `always` there.
    """
    fitted, held_out = folder / "with", folder / "without"
    fitted.mkdir()
    held_out.mkdir()
    campaign = write(fitted, terms, parameters, orders=orders)
    write(held_out, *always)
    (held_out / "r3.npz").replace(fitted / "r3.npz")
    return campaign


def shorten_library(monkeypatch, kept=LIBRARY):
    """Only so many effects are tried."""
    whole = session.candidates
    monkeypatch.setattr(session, "candidates", lambda *given: [one for one in whole(*given) if one.effect in kept])
