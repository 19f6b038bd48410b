"""The torsional mode after an event: a damped sinusoid fitted to the windup rate."""

import math
from operator import itemgetter

from .drive import Drive
from .fit import dot, fit_columns
from .integrate import Trajectory
from .signals import windup, windup_rate
from .stepper import Vector

SAMPLES = 128
LINES = 4
ITERATIONS = 12
UNEXPLAINED = 0.25
MISSING = (math.nan, math.nan, math.nan)


def linear_mode(drive: Drive, phi: float = 0.0) -> tuple[float, float, float]:
    """Angular frequency [rad/s] and decay rate [1/s] of the free mode about the windup `phi` [rad], and J_M/J_T."""
    motor = drive.ratio**2 * drive.J_m
    total = motor + drive.J_l
    effective = motor * drive.J_l / total
    damping = drive.ratio**2 * (drive.B_m + drive.B_ml) * (drive.J_l / total) ** 2
    damping += drive.B_l * (motor / total) ** 2 + drive.B_sp
    return math.sqrt(drive.tangent(phi) / effective), damping / (2.0 * effective), motor / total


def fit_mode(run: Trajectory, event: float, limit: float) -> tuple[float, float, float]:
    """Frequency [Hz], decay [1/s] and amplitude of the output speed [rad/s] extrapolated to the event.

    The window is five decay times, at most until `limit`. An offset, a slope and the strongest lines of the kinematic
    error that turn at least once are fitted along with the mode, from the free mode about the mean windup of the window
    on. NaN where no single damped wave fits: none is found in 12 iterations, or more of the data than a quarter of the
    wave is left, rms over rms.
    """
    drive = run.drive
    if drive.rigid or not limit > event:
        return MISSING
    decay = linear_mode(drive)[1]
    width = min(limit - event, 5.0 / decay) if decay > 0.0 else limit - event
    times = [width * k / SAMPLES for k in range(1, SAMPLES + 1)]
    states = [run.at(event + t)[0] for t in times]
    data = [windup_rate(drive, y) for y in states]
    angles = [y[0] for y in states]
    omega, decay, share = linear_mode(drive, sum(windup(drive, y) for y in states) / SAMPLES)
    background = [[1.0] * SAMPLES, times]
    for order in strongest_lines(drive, angles[-1] - angles[0]):
        background += [[math.cos(order * a) for a in angles], [math.sin(order * a) for a in angles]]
    for _ in range(ITERATIONS):
        waves = [math.exp(-decay * t) for t in times]
        even = [w * math.cos(omega * t) for w, t in zip(waves, times, strict=True)]
        odd = [w * math.sin(omega * t) for w, t in zip(waves, times, strict=True)]
        bends = [[t * w for w, t in zip(wave, times, strict=True)] for wave in (even, odd)]
        columns = [even, odd, *bends, *background]
        found = fit_columns(columns, data)
        a, b, c, d = found[:4]
        square = a * a + b * b
        if not square > 0.0:
            return MISSING
        faster, stronger = (c * b - d * a) / square, -(c * a + d * b) / square
        omega += max(-0.2 * omega, min(0.2 * omega, faster))
        decay += max(-0.2 * omega, min(0.2 * omega, stronger))
        if abs(faster) + abs(stronger) < 1e-9 * omega:
            wave = [a * u + b * v for u, v in zip(even, odd, strict=True)]
            left = [y - dot(found, looks) for y, *looks in zip(data, *columns, strict=True)]
            if dot(left, left) > UNEXPLAINED**2 * dot(wave, wave):
                return MISSING
            return omega / (2.0 * math.pi), decay, share * math.sqrt(square)
    return MISSING


def strongest_lines(drive: Drive, travel: float) -> Vector:
    """Orders that force the mode most, by n^2 A_n, among those that turn at least once."""
    lines = [(n * n * math.hypot(a, b), n) for n, a, b in drive.series if abs(n * travel) > 2.0 * math.pi]
    return [n for strength, n in sorted(lines, key=itemgetter(0), reverse=True)[:LINES] if strength > 0.0]
