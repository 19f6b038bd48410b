"""Signals of a trajectory by name: functions of the state and the active input."""

from .drive import Drive
from .inputs import Segment
from .integrate import Trajectory
from .stepper import Vector

NAMES = [
    "theta_m",
    "omega_m",
    "theta_l",
    "omega_l",
    "te",
    "windup",
    "windup_rate",
    "theta_e",
    "tau_m",
    "tau_drive",
    "gear_torque",
]


def output_speed(drive: Drive, y: Vector) -> float:
    return drive.local_ratio(y[0]) * y[1] if drive.rigid else y[3]


def transmission_error(drive: Drive, y: Vector) -> float:
    return drive.kinematic_error(y[0])[0] if drive.rigid else y[2]


def windup(drive: Drive, y: Vector) -> float:
    return 0.0 if drive.rigid else y[2] - drive.kinematic_error(y[0])[0]


def windup_rate(drive: Drive, y: Vector) -> float:
    return 0.0 if drive.rigid else drive.local_ratio(y[0]) * y[1] - y[3]


def signal(drive: Drive, name: str, t: float, y: Vector, segment: Segment) -> float:
    """One signal in SI units at time t."""
    match name:
        case "theta_m":
            return y[0]
        case "omega_m":
            return y[1]
        case "theta_l":
            return y[0] / drive.ratio - transmission_error(drive, y)
        case "omega_l":
            return output_speed(drive, y)
        case "te":
            return transmission_error(drive, y)
        case "windup":
            return windup(drive, y)
        case "windup_rate":
            return windup_rate(drive, y)
        case "theta_e":
            return drive.kinematic_error(y[0])[0]
        case "tau_m":
            return drive.motor_torque(t, y, segment)[0]
        case "tau_drive":
            return drive.drive_torque(t, y, segment)
        case "gear_torque":
            return drive.gear_torque(t, y, segment)
    raise ValueError(f"signal must be one of {', '.join(NAMES)}, got {name!r}")


def sample(run: Trajectory, name: str, times: list[float]) -> list[float]:
    """One signal at the times asked for; NaN beyond the time the row reached."""
    values = []
    for t in times:
        if t > run.time or run.status == "bad_parameters":
            values.append(float("nan"))
        else:
            y, segment = run.at(t)
            values.append(signal(run.drive, name, t, y, segment))
    return values


def reported_state(run: Trajectory) -> Vector:
    """theta_m, omega_m, theta_l, omega_l, z of the last accepted step (theta_m, omega_m, z with one inertia)."""
    y = run.end
    if run.status == "bad_parameters":
        return y
    return list(y) if run.drive.rigid else [y[0], y[1], y[0] / run.drive.ratio - y[2], y[3], y[4]]
