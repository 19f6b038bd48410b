"""Simulated recordings for the tests of the health checks: drives, manoeuvres, rates, sensors, all by seed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from hdfast import Model, Scenario, simulate
from hdfast.drive_file import read_drive
from hdfast.recordings import Campaign, CampaignRecording
from hdfast.recordings.rig import read_controller
from hdfast.sections import Sections
from hdfast.sensors.facts import read_sensors

RATIO, J_M, J_L = 121.0, 3e-4, 0.5
DRIVE = f"[drive]\nratio = {RATIO}\nJ_m = {J_M}\nJ_l = {J_L}\n"
TEXT = DRIVE + "B_m = 6e-4\nB_l = 0.5\nB_ml = 6e-4\nB_sp = 20\nk1 = 3.1e4\n"
DURATION = 4.0


def manoeuvre(kind, rng):
    t = np.linspace(0.0, DURATION, 401)
    speed = rng.uniform(20.0, 60.0)
    if kind == "profile":
        marks = np.array([0, 0.3, 0.8, 1.4, 2.0, 2.8, 3.4, 4.0]) * rng.uniform(0.9, 1.0)
        return Scenario.speed_profile(t, speed=np.interp(t, marks, speed * np.array([0, 0, 1, 1, -0.6, -0.6, 0, 0])))
    if kind == "sine":
        return Scenario.speed_profile(t, speed=speed * np.sin(2.0 * np.pi * rng.uniform(0.4, 1.2) * t))
    if kind == "start_stop":
        return Scenario.start_stop(speed_rpm=speed * 9.55, t_on=0.2, t_off=2.5, t_end=DURATION)
    if kind == "ladder":
        steps = speed * np.repeat([0.2, 0.5, 1.0, -0.2, -0.5, -1.0, 0.5, 0.0], 51)[:401]
        return Scenario.speed_profile(t, speed=np.convolve(np.pad(steps, 5, "edge"), np.ones(11) / 11, "valid"))
    tones = sum(np.sin(2.0 * np.pi * f * t + rng.uniform(0, 6.28)) for f in (0.5, 1.3, 2.9, 6.1))
    return Scenario.torque_profile(t, 0.06 * tones)


KINDS = ("profile", "sine", "start_stop", "ladder", "multisine")


def columns(seed, kind=None, rate=None, noise=None, bits=None, terms=("coulomb_friction",)):
    """A recording of the default drive through encoders and torque cells, and the stated [sensors]."""
    rng = np.random.default_rng(seed)
    kind = KINDS[seed % len(KINDS)] if kind is None else kind
    rate = rng.choice([250.0, 500.0, 1000.0, 2000.0]) if rate is None else rate
    noise = rng.choice([0.0, 1e-3, 5e-3]) if noise is None else noise
    bits = int(rng.choice([0, 15, 17, 20])) if bits is None else bits
    scenario = manoeuvre(kind, rng)
    t = np.arange(int(DURATION * rate)) / rate
    signals = {
        "motor_angle": "theta_m",
        "motor_torque": "tau_m",
        "load_angle": "theta_l",
        "output_torque": "gear_torque",
    }
    run = simulate(
        {"J_l": J_L * rng.uniform(0.8, 1.2), "T_c": rng.uniform(0.01, 0.04)},
        model=Model(terms=list(terms), orders=[2, 4]),
        scenario=scenario,
        t_eval=t,
        signals=list(signals.values()),
        metrics=[],
        max_steps=10**7,
        strict=True,
    )
    found = {"t": t} | {name: np.asarray(run[signal]) for name, signal in signals.items()}
    found["motor_torque"] = found["motor_torque"] + noise * rng.standard_normal(t.size)
    found["output_torque"] = found["output_torque"] + 20.0 * noise * rng.standard_normal(t.size)
    found["load_angle"] = found["load_angle"] + 1e-6 * rng.standard_normal(t.size)
    facts = ""
    if bits:
        step = 2.0 * np.pi / 2**bits
        found["motor_angle"] = step * np.round(found["motor_angle"] / step)
        fine = step / 16.0
        found["load_angle"] = fine * np.round(found["load_angle"] / fine)
        facts = f"[sensors]\nmotor_angle = {{ resolution = {step!r} }}\nload_angle = {{ resolution = {fine!r} }}\n"
    return found, facts


def campaign(recordings, text=TEXT):
    """A campaign in memory: recordings are columns, or (columns, facts of the [[recording]])."""
    file = Sections(text, "campaign.toml")
    sensors = read_sensors(file)
    steps = {name: facts.resolution for name, facts in sensors.items() if facts.resolution is not None}
    listed = []
    for number, item in enumerate(recordings):
        found, facts = item if isinstance(item, tuple) else (item, {})
        listed.append(CampaignRecording(f"run{number}", found, steps, file=Path(f"run{number}"), **facts))
    return Campaign("test", listed, read_drive(file), sensors, read_controller(file), {}, file.data, file.text)
