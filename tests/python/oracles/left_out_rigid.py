"""The physics catalogue's effects on a drive with a rigid gear, solved by SciPy.

The output follows the motor: its acceleration is the derivative of (local ratio times motor speed) along the motion, by
finite differences. What is missing in the balance of the motor is a broken line over the acceleration, with its corner
where the gear carries nothing.
"""

from __future__ import annotations

import numpy as np

from oracles.left_out import LeftOut

# weights of the five-point first derivative, at -2, -1, 1, 2 steps
STENCIL = ((-2, 1 / 12), (-1, -8 / 12), (1, 8 / 12), (2, -1 / 12))
STEP = 1e-6


class RigidLeftOut(LeftOut):
    """As `LeftOut`; angle and speed of the output are carried along, but never read."""

    def sticky(self):
        return any(super().sticky()), False

    def start(self):
        x = super().start()
        x[2] = -self.kinematic_error(x, np.zeros(self.size))[0]
        return x

    def output_speed(self, x):
        return (1 / self.p["ratio"] - self.kinematic_error(x, np.zeros(self.size))[1]) * x[1]

    def output_acceleration(self, x, rates, acceleration):
        along = rates.copy()
        along[0], along[1] = x[1], acceleration
        return sum(weight * self.output_speed(x + k * STEP * along) for k, weight in STENCIL) / STEP

    def balance(self, t, x, directions):
        p, x, rates = self.p, x.copy(), np.zeros(self.size)
        error, slope = self.kinematic_error(x, rates)
        local_ratio = 1 / p["ratio"] - slope
        x[2], x[3] = x[0] / p["ratio"] - error, local_ratio * x[1]
        torque, inertia = self.drive(x, rates)
        load, far_inertia = self.output(t, x, rates)
        on_motor, slip = self.damping(x, directions[0])
        drag = p["B_l"] * x[3] - p["s"] * slip + load
        net = torque - on_motor - slip
        at_rest = self.output_acceleration(x, rates, 0.0)
        per_acceleration = self.output_acceleration(x, rates, 1.0) - at_rest

        def gear_torque(acceleration, way):
            dry = way * p["T_cl"] if "load_side_friction" in self.on else 0.0
            return far_inertia * (at_rest + per_acceleration * acceleration) + drag + dry

        def resisting(acceleration, way, rates):
            carried = gear_torque(acceleration, way)
            return local_ratio * carried + self.motor_friction(x, carried, way, rates)

        def missing(acceleration):
            return inertia * acceleration + resisting(acceleration, way, np.zeros(self.size)) - net

        way = directions[0]
        acceleration = 0.0
        if way:
            corner = -gear_torque(0.0, way) / (far_inertia * per_acceleration)
            at_corner = missing(corner)
            beyond = corner - np.sign(at_corner) * (1.0 + abs(corner))
            acceleration = corner - at_corner * (beyond - corner) / (missing(beyond) - at_corner)
        resisting(acceleration, way, rates)
        rates[0], rates[1], rates[2] = x[1], acceleration, x[3]
        rates[3] = at_rest + per_acceleration * acceleration
        return rates, (net, 0.0), [lambda: [resisting(0.0, d, np.zeros(self.size)) for d in (-1, 1)]]
