"""The equations of motion (model of two inertias, and its rigid limit), written one formula per line."""

import math

from .inputs import MOTION, SPEED, Controller, Segment
from .problem import Problem


class Drive:
    """Kinematics, spring and equations of one row.

    State of two inertias: [theta_m, omega_m, te, omega_l, z] with te = theta_m/i - theta_l; of one inertia:
    [theta_m, omega_m, z]. z is the integral of the speed controller.
    """

    def __init__(self, problem: Problem) -> None:
        p = problem.parameters
        self.rigid = problem.base == "one_inertia"
        self.spring_kind = problem.spring
        self.p = p
        self.ratio, self.J_m, self.J_l, self.s = p["ratio"], p["J_m"], p["J_l"], p["s"]
        self.B_m, self.B_l, self.B_ml, self.B_sp = p["B_m"], p["B_l"], p["B_ml"], p["B_sp"]
        scale = p["te_scale"]
        self.series = [
            (order, scale * p[f"te_cos_{label}"], scale * p[f"te_sin_{label}"])
            for order, label in zip(problem.orders, problem.labels, strict=True)
        ]
        self.controller = Controller(p["K_p"], p["K_i"], p["tau_max"])

    def kinematic_error(self, theta: float) -> tuple[float, float, float]:
        """Kinematic error [rad] and its first and second derivative with respect to the motor angle."""
        e = de = dde = 0.0
        for n, a, b in self.series:
            c, s = math.cos(n * theta), math.sin(n * theta)
            e += a * c + b * s
            de += n * (b * c - a * s)
            dde -= n * n * (a * c + b * s)
        return e, de, dde

    def local_ratio(self, theta: float) -> float:
        return 1.0 / self.ratio - self.kinematic_error(theta)[1]

    def spring(self, phi: float) -> tuple[float, float]:
        """Spring torque [N m] and stored energy [J] at windup `phi` [rad]."""
        return self._polynomial(phi) if self.spring_kind == "polynomial" else self._piecewise(phi)

    def _polynomial(self, phi: float) -> tuple[float, float]:
        p = self.p
        x = min(max(phi, -p["phi_max"]), p["phi_max"])
        k = [p["k1"], p["k2"], p["k3"], p["k4"], p["k5"]]
        torque = sum(k_n * x ** (n + 1) for n, k_n in enumerate(k))
        energy = sum(k_n * x ** (n + 2) / (n + 2) for n, k_n in enumerate(k))
        if x == phi:
            return torque, energy
        tangent = sum((n + 1) * k_n * x**n for n, k_n in enumerate(k))
        beyond = phi - x
        return torque + tangent * beyond, energy + torque * beyond + 0.5 * tangent * beyond**2

    def _piecewise(self, phi: float) -> tuple[float, float]:
        p = self.p
        torque = energy = 0.0
        left = abs(phi)
        for slope, limit in ((p["K1"], p["T1"]), (p["K2"], p["T2"]), (p["K3"], math.inf)):
            part = min(left, (limit - torque) / slope)
            energy += torque * part + 0.5 * slope * part**2
            torque += slope * part
            left -= part
        return math.copysign(torque, phi), energy

    def tangent(self, phi: float) -> float:
        """Slope of the spring [N m/rad]."""
        p = self.p
        if self.spring_kind == "polynomial":
            x = min(max(phi, -p["phi_max"]), p["phi_max"])
            return sum(n * p[f"k{n}"] * x ** (n - 1) for n in range(1, 6))
        torque = abs(self.spring(phi)[0])
        return p["K1"] if torque <= p["T1"] else p["K2"] if torque <= p["T2"] else p["K3"]

    def windup_under(self, torque: float) -> float:
        """Windup [rad] at which the spring carries `torque` [N m] (Newton's method kept inside a bracket)."""
        low, high = -1e-4, 1e-4
        while self.spring(low)[0] > torque:
            low *= 2
        while self.spring(high)[0] < torque:
            high *= 2
        phi = 0.0
        for _ in range(200):
            excess = self.spring(phi)[0] - torque
            if excess > 0:
                high = phi
            else:
                low = phi
            step = phi - excess / self.tangent(phi)
            following = step if low <= step <= high else 0.5 * (low + high)
            if following == phi:
                break
            phi = following
        return phi

    def motor_torque(self, t: float, y: list[float], segment: Segment) -> tuple[float, float]:
        """Motor torque [N m], for prescribed motion the one it takes, and the rate of the integrator z."""
        if segment.kind == SPEED:
            return self.controller.torque(segment.reference_at(t) - y[1], y[-1])
        if segment.kind == MOTION:
            return self._needed_torque(t, y, segment), 0.0
        return segment.tau_at(t), 0.0

    def drive_torque(self, t: float, y: list[float], segment: Segment) -> float:
        """Torque that the drive delivers [N m]: with prescribed motion the one it is asked for meanwhile."""
        return segment.tau_at(t) if segment.kind == MOTION else self.motor_torque(t, y, segment)[0]

    def _needed_torque(self, t: float, y: list[float], segment: Segment) -> float:
        theta, omega, acceleration = segment.motion_at(t)
        if self.rigid:
            upsilon, inertia, damping, curvature = self._rigid_coefficients(theta)
            return inertia * acceleration + damping * omega - curvature * omega**2 + upsilon * segment.load_at(t)
        upsilon = self.local_ratio(theta)
        drag = self.B_m * omega + self.B_ml * (omega - self.s * y[3])
        return self.J_m * acceleration + drag + upsilon * self.gear_torque(t, y, segment)

    def _rigid_coefficients(self, theta: float) -> tuple[float, float, float, float]:
        """Local ratio, inertia, damping and the factor of omega_m^2, all in the motor coordinate."""
        _, de, dde = self.kinematic_error(theta)
        upsilon = 1.0 / self.ratio - de
        inertia = self.J_m + upsilon**2 * self.J_l
        damping = self.B_m + self.B_ml * (1 - self.s * upsilon) ** 2 + upsilon**2 * self.B_l
        return upsilon, inertia, damping, self.J_l * upsilon * dde

    def gear_torque(self, t: float, y: list[float], segment: Segment) -> float:
        """Torque of the gear on the load [N m]: spring plus mesh damping, or what the rigid gear has to carry."""
        if self.rigid:
            _, de, dde = self.kinematic_error(y[0])
            upsilon = 1.0 / self.ratio - de
            slope = self.slope(t, y, segment)
            output_acceleration = upsilon * slope[1] - dde * y[1] ** 2
            slip = y[1] - self.s * upsilon * y[1]
            return (
                self.J_l * output_acceleration
                + self.B_l * upsilon * y[1]
                - self.s * self.B_ml * slip
                + segment.load_at(t)
            )
        e, de, _ = self.kinematic_error(y[0])
        windup_rate = (1.0 / self.ratio - de) * y[1] - y[3]
        return self.spring(y[2] - e)[0] + self.B_sp * windup_rate

    def slope(self, t: float, y: list[float], segment: Segment) -> list[float]:
        """Time derivative of the state; NaN where the numbers leave the range of floats."""
        try:
            return self._slope_rigid(t, y, segment) if self.rigid else self._slope_two(t, y, segment)
        except (OverflowError, ValueError):
            return [math.nan] * len(y)

    def _slope_two(self, t: float, y: list[float], segment: Segment) -> list[float]:
        theta_m, omega_m, te, omega_l, _ = y
        if segment.kind == MOTION:
            theta_m, omega_m, acceleration = segment.motion_at(t)
        e, de, _ = self.kinematic_error(theta_m)
        upsilon = 1.0 / self.ratio - de
        gear = self.spring(te - e)[0] + self.B_sp * (upsilon * omega_m - omega_l)
        drag = self.B_ml * (omega_m - self.s * omega_l)
        z_rate = 0.0
        if segment.kind != MOTION:
            tau, z_rate = self.motor_torque(t, y, segment)
            acceleration = (tau - self.B_m * omega_m - drag - upsilon * gear) / self.J_m
        load_acceleration = (gear + self.s * drag - self.B_l * omega_l - segment.load_at(t)) / self.J_l
        return [omega_m, acceleration, omega_m / self.ratio - omega_l, load_acceleration, z_rate]

    def _slope_rigid(self, t: float, y: list[float], segment: Segment) -> list[float]:
        if segment.kind == MOTION:
            _, omega_m, acceleration = segment.motion_at(t)
            return [omega_m, acceleration, 0.0]
        theta_m, omega_m, _ = y
        upsilon, inertia, damping, curvature = self._rigid_coefficients(theta_m)
        tau, z_rate = self.motor_torque(t, y, segment)
        force = tau - upsilon * segment.load_at(t) - damping * omega_m + curvature * omega_m**2
        return [omega_m, force / inertia, z_rate]

    def energy(self, y: list[float]) -> float:
        """Kinetic plus elastic energy [J]."""
        if self.rigid:
            return 0.5 * (self.J_m + self.local_ratio(y[0]) ** 2 * self.J_l) * y[1] ** 2
        windup = y[2] - self.kinematic_error(y[0])[0]
        return 0.5 * self.J_m * y[1] ** 2 + 0.5 * self.J_l * y[3] ** 2 + self.spring(windup)[1]
