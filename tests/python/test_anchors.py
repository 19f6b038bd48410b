"""The converted recordings of real machines give the figures known for them: signs, units and clocks are right."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from anchors import bam, brfd, daisy, emps, heads, hej90, kinova, tx40, ur10e
from anchors.oracle import Record, decimated, error, fitted, line, low_pass, motion, play, read_folder
from anchors.source import read


def laws(speed: np.ndarray, acceleration: np.ndarray) -> dict[str, list[np.ndarray]]:
    """Inertia and growing friction."""
    one = np.ones_like(speed)
    sign = np.sign(speed)
    return {
        "viscous": [acceleration, speed],
        "coulomb": [acceleration, speed, sign],
        "offset": [acceleration, speed, sign, one],
        "asymmetric": [acceleration, speed, sign, one, np.abs(speed)],
    }


def whole_emps(tmp_path) -> Record:
    _, (fit, rest) = read_folder(emps.write(tmp_path))
    joined = {key: np.concatenate([fit[key], rest[key]]) for key in ("motor_angle", "motor_torque")}
    return Record("whole", "fit", joined | {"t": emps.PERIOD * np.arange(len(joined["motor_angle"]))})


def test_against_published_emps_inverse_model(tmp_path):
    record = whole_emps(tmp_path)
    torque = decimated(record["motor_torque"], 10)[5:-5]
    reached = {}
    for name, columns in laws(*motion(record, 60.0)).items():
        few = [decimated(column, 10)[5:-5] for column in columns]
        reached[name] = error(few, fitted(few, torque), torque)
        if name == "offset":
            inertia, viscous, coulomb, offset = fitted(few, torque)
    assert reached == pytest.approx({"viscous": 17.95, "coulomb": 7.11, "offset": 4.04, "asymmetric": 3.06}, abs=0.1)
    assert inertia / emps.ARM**2 == pytest.approx(95.1089, rel=2e-3)
    assert viscous / emps.ARM**2 == pytest.approx(203.5034, rel=5e-3)
    assert coulomb / emps.ARM == pytest.approx(20.3935, rel=5e-3)
    assert offset / emps.ARM == pytest.approx(-3.1648, rel=2e-2)


def test_exact_emps_speed_controller_equals_the_cascade():
    reference = np.cumsum(np.random.default_rng(1).normal(size=400)) * 1e-4
    position = np.cumsum(np.random.default_rng(2).normal(size=400)) * 1e-4 + 0.3
    n = emps.speed_reference(reference, position[0])
    integral = np.concatenate([[0.0], np.cumsum(0.5 * emps.PERIOD * (n[1:] + n[:-1]))])
    by_speed = n + emps.K_P * (integral - (position - position[0]))
    np.testing.assert_allclose(by_speed, emps.K_P * (reference - position), rtol=0.0, atol=1e-9)


def test_against_recorded_emps_controller(tmp_path):
    sections, records = read_folder(emps.write(tmp_path))
    gains = sections["controller"]
    for record in records:
        angle, n = record["motor_angle"], record["speed_reference"]
        speed = np.diff(angle, prepend=angle[0]) / emps.PERIOD
        integral = np.concatenate([[0.0], np.cumsum(0.5 * emps.PERIOD * (n[1:] + n[:-1]))]) - (angle - angle[0])
        torque = gains["kp"] * (n - speed) + gains["ki"] * integral
        rest = torque[1:] - record["motor_torque"][1:]
        assert np.linalg.norm(rest) < 0.04 * np.linalg.norm(record["motor_torque"])


FRICTION: dict[str, Callable[[list[float], float], float]] = {
    "viscous": lambda p, w: p[1] * w,
    "coulomb": lambda p, w: p[1] * w + p[2] * ((w > 0.0) - (w < 0.0)),
    "offset": lambda p, w: p[1] * w + p[2] * ((w > 0.0) - (w < 0.0)) + p[3],
    "asymmetric": lambda p, w: p[1] * w + p[2] * ((w > 0.0) - (w < 0.0)) + p[3] + p[4] * abs(w),
}


def closed_loop_force(law: str, p: list[float], reference: list[float], start: float) -> np.ndarray:
    """Cascade of the machine at 1 kHz with its speed from the last two positions, held between the samples [N]."""
    friction, gain = FRICTION[law], emps.NEWTON_PER_VOLT * emps.K_V
    position, speed, last = start, 0.0, start
    half = 0.5 * emps.PERIOD
    force = []
    for wanted in reference:
        u = gain * (emps.K_P * (wanted - position) - (position - last) / emps.PERIOD)
        force.append(u)
        last = position
        for _ in range(2):
            middle = speed + 0.5 * half * (u - friction(p, speed)) / p[0]
            position += half * middle
            speed += half * (u - friction(p, middle)) / p[0]
    return np.array(force)


def test_against_published_emps_closed_loop(tmp_path):
    raw = read("emps_estimation")
    record = whole_emps(tmp_path)
    size = int(emps.FIT_SHARE * len(raw["t"]))
    reached = {}
    for name, columns in laws(*motion(record, 60.0)).items():
        few = [decimated(column[:size], 10)[5:-5] for column in columns]
        factors = fitted(few, decimated(record["motor_torque"][:size], 10)[5:-5])
        units = [emps.ARM**2, emps.ARM**2, emps.ARM, emps.ARM, emps.ARM**2][: len(factors)]
        force = closed_loop_force(name, (factors / units).tolist(), raw["pos_ref_m"].tolist(), float(raw["pos_m"][0]))
        rest = raw["force_N"][size:] - force[size:]
        reached[name] = 100.0 * np.linalg.norm(rest) / np.linalg.norm(raw["force_N"][size:])
    assert reached == pytest.approx({"viscous": 18.06, "coulomb": 7.41, "offset": 4.53, "asymmetric": 3.67}, abs=0.6)


# Without gravity the figure of joint 2 (66.2 %) hangs on the offset that the published fit had.
UR10E = {
    1: {"viscous": 23.3, "gravity": 23.2, "coulomb": 10.9, "order": 8.2},
    2: {"gravity": 8.5, "coulomb": 3.7, "order": 3.6},
    4: {"viscous": 39.9, "gravity": 22.2, "coulomb": 7.9, "order": 6.8},
}


def ur10e_columns(record: Record) -> dict[str, list[np.ndarray]]:
    speed, acceleration = motion(record, 10.0)
    angle = record["motor_angle"] / ur10e.RATIO
    viscous = [acceleration, speed]
    gravity = [*viscous, np.sin(angle), np.cos(angle)]
    coulomb = [*gravity, np.tanh(speed / 0.5)]
    order = [*coulomb, np.cos(2.0 * record["motor_angle"]), np.sin(2.0 * record["motor_angle"])]
    return {"viscous": viscous, "gravity": gravity, "coulomb": coulomb, "order": order}


@pytest.mark.parametrize("joint", [1, 2, 4])
def test_against_published_ur10e_current_error(tmp_path, joint):
    _, (fit, rest) = read_folder(ur10e.write(tmp_path, joint))
    known, unseen = ur10e_columns(fit), ur10e_columns(rest)
    torque, wanted = (low_pass(record["motor_torque"], record["t"], 35.0) for record in (fit, rest))
    reached = {name: error(unseen[name], fitted(known[name], torque), wanted) for name in UR10E[joint]}
    assert reached == pytest.approx(UR10E[joint], rel=0.15)


def test_against_published_ur10e_ripple_is_twice_per_motor_turn(tmp_path):
    _, (fit, _) = read_folder(ur10e.write(tmp_path, 1))
    columns = ur10e_columns(fit)["coulomb"]
    rest = fit["motor_torque"] - np.stack(columns, 1) @ fitted(columns, fit["motor_torque"])
    orders = np.arange(0.5, 3.0, 0.01)
    found = line(rest, fit["motor_angle"], orders)
    assert orders[np.argmax(found)] == pytest.approx(2.0, abs=0.02)


def kinova_steady(record: Record) -> tuple[np.ndarray, ...]:
    keep = record["t"] > 1.0
    return tuple(record[key][keep] for key in ("t", "motor_angle", "motor_torque", "output_torque"))


def test_against_published_kinova_friction_and_lines(tmp_path):
    _, records = read_folder(kinova.write(tmp_path))
    speeds, friction = [], []
    for record in records:
        t, angle, torque, output = kinova_steady(record)
        speeds.append(np.polyfit(t, angle / kinova.RATIO, 1)[0])
        friction.append(kinova.RATIO * torque.mean())
        orders = np.arange(1.5, 5.0, 0.01) if speeds[-1] < 1.2 else np.arange(1.5, 2.5, 0.01)
        found = line(output, angle, orders)
        for order in (2.0, 4.0) if speeds[-1] < 1.2 else (2.0,):
            near = np.abs(orders - order) < 0.5
            assert orders[near][np.argmax(found[near])] == pytest.approx(order, abs=0.05)
    slope, intercept = np.polyfit(speeds, friction, 1)
    assert (intercept, slope) == pytest.approx((1.39, 0.69), rel=0.05)


def test_against_published_kinova_line_fixed_in_frequency(tmp_path):
    _, records = read_folder(kinova.write(tmp_path))
    frequencies = np.arange(3.0, 9.0, 0.05)
    for record in records:
        t, angle, torque, _ = kinova_steady(record)
        if np.ptp(angle) > 50.0:
            peak = frequencies[np.argmax(line(torque, t, 2.0 * np.pi * frequencies))]
            assert 5.0 < peak < 6.0


def test_against_known_bam_pendulum_and_friction_in_proportion_to_its_torque(tmp_path):
    """The weight of known mass and length gives the scale of the torque; gear and bearings then lose as published."""
    _, records = read_folder(bam.write(tmp_path))
    known = 0.49 * 9.81 * 0.1
    columns, torque = [], []
    for record in (record for record in records if record.role == "fit"):
        speed, acceleration = motion(record, 7.0)
        weight = np.sin(record["motor_angle"])
        carried = np.abs(known * weight + bam.PENDULUM * acceleration) * np.tanh(speed / 0.1)
        columns.append([acceleration, speed, carried, weight])
        torque.append(low_pass(record["motor_torque"], record["t"], 7.0))
    inertia, viscous, share, gravity = fitted(np.concatenate(columns, 1), np.concatenate(torque))
    scale = gravity / known
    assert scale == pytest.approx(1.0, abs=0.3)
    assert inertia / scale == pytest.approx(bam.PENDULUM + bam.ARMATURE, rel=0.1)
    assert 0.2 < share / scale < 0.5
    assert 0.004 < viscous / scale < 0.019
    # k_t / R is published within 30 %; what this conversion makes of it is told from a slip in it by less
    assert [scale, share / scale, viscous / scale] == pytest.approx([1.247, 0.321, 0.00861], rel=0.02)


def test_against_known_bam_torque_off_phase(tmp_path):
    _, records = read_folder(bam.write(tmp_path))
    dropped = [record for record in records if "lift_and_drop" in record.name]
    assert len(dropped) == 2
    for record in dropped:
        assert not record["motor_torque"][record["t"] > 2.01].any()
        assert record["motor_torque"][record["t"] < 1.99].any()


def test_exact_bam_torque_is_that_of_the_voltage_less_the_back_emf():
    t = np.arange(0.0, 2.0, 5e-3)
    raw = {"t": t, "q": 3.0 * t, "duty": np.full(t.size, 442.5), "volts": np.full(t.size, 8.0)}
    raw["torque_enable"] = (t < 1.0).astype(float)
    found = bam.voltage(raw)
    assert found[(t > 0.3) & (t < 1.0)] == pytest.approx(4.0 - 3.0 * bam.TORQUE_CONSTANT, abs=1e-3)
    assert not found[t >= 1.0].any()


def test_against_known_damper_coulomb_explains_little_and_memory_much(tmp_path):
    _, records = read_folder(brfd.write(tmp_path))
    for record in records:
        force, x = record["output_torque"], record["motor_angle"]
        speed, _ = motion(record, 20.0)
        coulomb = [np.sign(speed)]
        memory = [play(x, gap) for gap in 0.5 * np.ptp(x) * np.linspace(0.0, 0.95, 16)]
        assert error(coulomb, fitted(coulomb, force), force) > 65.0
        assert error(memory, fitted(memory, force), force) < 25.0


def test_against_known_head_stiffness_falls_with_amplitude(tmp_path):
    _, records = read_folder(heads.write(tmp_path))
    period = 9.84
    found = []
    for record in (record for record in records if record.role == "fit" and record["t"][-1] > 60.0):
        angle, effort = (low_pass(record[key], record["t"], 1.0, 2) for key in ("motor_angle", "motor_torque"))
        for begin in np.arange(2.0, record["t"][-1] - period, period):
            keep = (record["t"] >= begin) & (record["t"] < begin + period)
            ramp = record["t"][keep] - begin
            stiffness = fitted([angle[keep], ramp, np.ones_like(ramp)], effort[keep])[0]
            found.append((np.ptp(effort[keep]), stiffness))
    amplitude, stiffness = np.array(found).T
    assert np.median(stiffness[amplitude < 0.1]) == pytest.approx(2990.0, rel=0.2)
    assert np.median(stiffness[amplitude > 0.25]) < 0.6 * 2990.0


def test_against_known_hej90_values_are_held(tmp_path):
    _, records = read_folder(hej90.write(tmp_path))
    for record in records:
        for column in ("motor_angle", "motor_torque", "output_torque"):
            renewed = record["t"][np.flatnonzero(np.diff(record[column])) + 1]
            assert np.median(np.diff(renewed)) == pytest.approx(0.015, abs=0.001)


def test_against_published_tx40_joint_4(tmp_path):
    _, (record, _) = read_folder(tx40.write(tmp_path))
    speed, acceleration = motion(record, 50.0)
    torque = low_pass(record["motor_torque"], record["t"], 50.0)
    viscous = [acceleration, speed]
    coulomb = [*viscous, np.tanh(speed / 0.5)]
    assert error(viscous, fitted(viscous, torque), torque) == pytest.approx(24.0, abs=1.0)
    assert error(coulomb, fitted(coulomb, torque), torque) == pytest.approx(10.4, abs=1.0)


def test_against_published_daisy_modes():
    frequencies, damping = daisy.modes(6)
    assert frequencies == pytest.approx([0.058, 0.127, 0.215], abs=1e-3)
    assert (damping < 0.1).all()
