"""Simulate examples/concealed-friction: a drive whose friction its controller and its other parameters hide."""

import sys
from pathlib import Path

import hdfast
import numpy as np
from hdfast.files import write_text
from hdfast.recordings import Recording, save

FOLDER = Path(__file__).parent.parent / "examples" / "concealed-friction"
RATE, DURATION = 500.0, 4.5
CONTROLLER = {"K_p": 0.08, "K_i": 1.6, "tau_max": 2.0}
ENCODER, LOAD_ENCODER, CURRENT = 2.0 * np.pi / 2**17, 2.0 * np.pi / 2**20, 1e-3
TORQUE_NOISE, LOAD_NOISE = 2e-3, 1e-6
SPRING = {"k3": 1.3445e10, "k5": -3.211e15, "phi_max": 1.465e-3}
ORDERS = [1, 2, 4]
NOMINAL = {
    "J_m": (3.0e-4, 0.10), "J_l": (0.50, 0.10), "B_m": (6.0e-4, 0.5), "B_ml": (6.0e-4, 0.5), "B_l": (0.50, 0.5),
    "B_sp": (20.0, 0.5), "k1": (31020.0, 0.10),
}  # fmt: skip
NOMINAL_ERROR = {"cos": [-6.2e-6, 7.1e-5, 2.0e-5], "sin": [1.9e-5, 5.5e-5, -8.3e-6]}
TRUE = {"J_m": 2.88e-4, "J_l": 0.53, "B_m": 5.2e-4, "B_ml": 5.4e-4, "B_l": 0.43, "B_sp": 23.0, "k1": 32400.0}
TRUE_ERROR = {"cos": [-7.0e-6, 6.8e-5, 2.2e-5], "sin": [2.1e-5, 5.8e-5, -7.5e-6]}
FRICTION = {
    "stribeck_friction": {"T_c": 0.022, "breakaway_ratio": 1.5, "omega_s": 4.0},
    "load_dependent_friction": {"c_drive": 0.13, "c_back": 0.13},
}
LADDER = (
    np.array([0.0, 0.3, 0.5, 1.2, 1.4, 2.1, 2.3, 2.9, 3.1, 3.7, 3.9, DURATION]),
    np.array([0.0, 0.0, 3.0, 3.0, 9.0, 9.0, -9.0, -9.0, -3.0, -3.0, 0.0, 0.0]),
)
TRAPEZOID = (
    np.array([0.0, 0.3, 0.7, 1.7, 2.3, 3.1, 3.6, DURATION]),
    np.array([0.0, 0.0, 1.0, 1.0, -0.6, -0.6, 0.0, 0.0]),
)
SWING = (np.linspace(0.0, DURATION, 451), np.sin(2.0 * np.pi * 0.6 * np.linspace(0.0, DURATION, 451)))
# role, table of times [s] and shares, motor speed of the share 1 [rad/s], load torque [N m]
MANOEUVRES = {
    "ladder": ("fit", LADDER, 1.0, 0.0),
    "driving": ("fit", TRAPEZOID, 36.0, 18.0),
    "lowering": ("fit", TRAPEZOID, 22.0, -14.0),
    "swing": ("fit", SWING, 28.0, 6.0),
    "proof-load": ("heldout", TRAPEZOID, -30.0, 25.0),
    "proof-ladder": ("heldout", LADDER, 3.0, -8.0),
}


def controlled(values, error, terms, times, speed, load):
    """One run under the speed controller, sampled at the rate of the recordings."""
    columns = {f"te_{wave}_{order}": size for wave in error for order, size in zip(ORDERS, error[wave], strict=True)}
    return hdfast.simulate(
        {**values, **SPRING, **columns},
        model=hdfast.Model(terms=terms, orders=ORDERS),
        scenario=hdfast.Scenario.speed_profile(times, speed=speed, t_end=DURATION, load=load, **CONTROLLER),
        t_eval=np.arange(int(DURATION * RATE)) / RATE,
        signals=["theta_m", "theta_l", "tau_m"],
        rtol=1e-8,
    )


def recorded(run, times, speed, load, rng):
    """What the encoders and the current sensor of the rig write down."""
    n = len(run.t)
    load_angle = run["theta_l"] + LOAD_NOISE * rng.standard_normal(n)
    motor_torque = run["tau_m"] + TORQUE_NOISE * rng.standard_normal(n)
    return {
        "t": run.t,
        "motor_angle": np.round(run["theta_m"] / ENCODER) * ENCODER,
        "load_angle": np.round(load_angle / LOAD_ENCODER) * LOAD_ENCODER,
        "motor_torque": np.round(motor_torque / CURRENT) * CURRENT,
        "load_torque": np.full(n, load),
        "speed_reference": np.interp(run.t, times, speed),
    }


def campaign(off_path, off_torque):
    """The campaign file: what is known of the drive and its sensors, and the recordings."""
    lines = [
        "# Simulated by tools/concealed_example.py: a drive with dry friction that its model lacks. The motor angle",
        "# hardly shows it: the nominal drive under the same controller follows the same path within",
        f"# {1e3 * off_path:.1f} thousandths of the travel, while its motor torque is off by {100 * off_torque:.0f} %.",
        'title = "Harmonic drive under speed control with concealed friction"',
        "",
        "[drive]",
        "ratio = 121",
        *(f"{name} = {{ value = {value:g}, sigma = {sigma:g} }}" for name, (value, sigma) in NOMINAL.items()),
        *(f"{name} = {value:g}" for name, value in SPRING.items()),
        "",
        "[kinematic_error]",
        f"orders = {ORDERS}",
        *(f"{wave} = [{', '.join(f'{size:g}' for size in NOMINAL_ERROR[wave])}]" for wave in NOMINAL_ERROR),
        "sigma = 1e-5",
        "",
        "[controller]",
        'kind = "pi"',
        f"kp = {CONTROLLER['K_p']}",
        f"ki = {CONTROLLER['K_i']}",
        f"limit = {CONTROLLER['tau_max']}",
        "",
        "[sensors]",
        f"motor_angle = {{ resolution = {ENCODER:.6g} }}",
        f"load_angle = {{ resolution = {LOAD_ENCODER:.6g}, noise = {LOAD_NOISE} }}",
        f"motor_torque = {{ resolution = {CURRENT}, noise = {TORQUE_NOISE} }}",
    ]
    for number, (name, (role, *_)) in enumerate(MANOEUVRES.items()):
        lines += ["", "[[recording]]", f'file = "{name}.parquet"', f'role = "{role}"', f'group = "{number}"']
    return "\n".join(lines) + "\n"


def main(folder):
    """Write the recordings and the campaign."""
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(121)
    true = TRUE | {name: value for part in FRICTION.values() for name, value in part.items()}
    nominal = {name: value for name, (value, _) in NOMINAL.items()}
    off_path, off_torque = [], []
    for name, (_, (times, shares), top, load) in MANOEUVRES.items():
        speed = top * shares
        run = controlled(true, TRUE_ERROR, list(FRICTION), times, speed, load)
        plain = controlled(nominal, NOMINAL_ERROR, [], times, speed, load)
        off_path.append(np.std(run["theta_m"] - plain["theta_m"]) / np.ptp(run["theta_m"]))
        off_torque.append(np.std(run["tau_m"] - plain["tau_m"]) / np.std(run["tau_m"]))
        save(Recording(name, recorded(run, times, speed, load, rng)), folder / f"{name}.parquet")
    write_text(folder / "campaign.toml", campaign(max(off_path), np.mean(off_torque)))


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else FOLDER)
