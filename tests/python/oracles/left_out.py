"""Equations (7*) and (8*) of the physics catalogue with any of its effects, one row at a time, solved by SciPy.

Dry friction is a set-valued law here: a shaft at rest stays there as long as the torque on it lies between the
resisting torques of the two directions. Written from the catalogue's equations; shares nothing with the terms of the
engine.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.signal import tf2ss

from oracles import lagrange

HIDDEN = {
    "presliding_friction": 1,
    "thermal_viscous": 1,
    "hysteresis": 1,
    "maxwell_slip": 4,
    "coupling_slip": 1,
    "ratcheting": 2,
    "viscoelastic": 2,
    "te_hysteresis": 1,
    "actuator_lag": 1,
    "delay": 2,
    "input_compliance": 2,
    "load_compliance": 2,
    "base_compliance": 2,
}
DRY_MOTOR = {"coulomb_friction", "stribeck_friction", "load_dependent_friction"}
LINES = ("te_harmonic", "te_load_dependence")


class LeftOut:
    """One drive: parameters by column name, effects by id, and the load torque [N m]."""

    def __init__(self, p, terms, load=0.0, spring="polynomial"):
        labels = [name.removeprefix("te_cos_") for name in p if name.startswith("te_cos_")]
        self.p, self.on, self.load, self.command = p, set(terms), load, 0.0
        self.gear = lagrange.Lagrangian(p, [float(label) for label in labels], labels, spring)
        self.spring = self.gear.spring_torque
        self.places = {}
        self.size = 4
        for term in terms:
            self.places[term] = slice(self.size, self.size + HIDDEN.get(term, 0))
            self.size += HIDDEN.get(term, 0)
        if "delay" in self.on:
            T = p["tau_d"]
            self.pade = tf2ss([T**2 / 12, -T / 2, 1.0], [T**2 / 12, T / 2, 1.0])

    def hidden(self, term, x):
        return x[self.places[term]]

    def kinematic_error(self, x, rates):
        """theta_e, its derivative with respect to theta_m, and the rate of the memory it may have."""
        p, theta = self.p, x[0]
        value, slope = self.gear.theta_e(theta), self.gear.theta_e(theta, 1)

        def add(amplitude, order):
            nonlocal value, slope
            turned = amplitude * np.exp(1j * order * theta)
            value, slope = value + turned.real, slope + (1j * order * turned).real

        for term in LINES:
            if term in self.on:
                amplitude = p[f"{term}_A_cos"] - 1j * p[f"{term}_A_sin"]
                factor = self.load if term == "te_load_dependence" else 1.0
                add(factor * amplitude, p[f"{term}_order"])
        if "te_beat" in self.on:
            add(p["te_beat_A_cos"] - 1j * p["te_beat_A_sin"], 2 * (p["ratio"] - 1) / p["ratio"])
        if "tooth_passage" in self.on:
            add(p["A_one_lobe"] * np.exp(1j * p["tooth_passage_psi_1"]), p["teeth"])
            add(p["A_both_lobes"] * np.exp(1j * p["tooth_passage_psi_2"]), 2 * p["teeth"])
        if "local_fault" in self.on:
            phase = p["local_fault_order"] * theta + p["local_fault_psi"]
            pulse = p["fault_height"] * np.exp(-2 * np.sin(phase / 2) ** 2 / p["fault_width"] ** 2)
            value += pulse
            slope -= pulse * p["local_fault_order"] * np.sin(phase) / p["fault_width"] ** 2
        if "te_hysteresis" in self.on:
            xi = self.hidden("te_hysteresis", x)[0]
            toward = np.tanh(x[1] / 0.05)
            per_angle = toward * (toward - xi) / p["settling_angle"]
            value += p["direction_offset"] * xi
            slope += p["direction_offset"] * per_angle
            rates[self.places["te_hysteresis"]] = per_angle * x[1]
        if "wear_run_in" in self.on:
            factor = 1 + p["error_wear"] * self.worn()
            value, slope = factor * value, factor * slope
        return value, slope

    def worn(self):
        return -np.expm1(-self.p["hours"] / self.p["run_in_hours"])

    def stored(self, windup):
        """Energy of the spring by quadrature of its torque, what it is softer by in closed form."""
        nodes, weights = np.polynomial.legendre.leggauss(12)
        energy = 0.5 * windup * np.sum(weights * self.spring(0.5 * windup * (nodes + 1)))
        if "soft_windup" in self.on:
            share = windup / self.p["phi_0"]
            energy -= self.p["delta_K"] * self.p["phi_0"] ** 2 * (np.logaddexp(share, -share) - np.log(2))
        return energy

    def spring_torque(self, x, windup):
        """Torque of the spring and the torques on motor and load of a varying stiffness."""
        p = self.p
        seen = windup
        if "coupling_slip" in self.on:
            seen -= self.hidden("coupling_slip", x)[0]
        if "ratcheting" in self.on:
            jumped, riding = self.hidden("ratcheting", x)
            seen = 0.0 if riding else seen - jumped
        if "backlash" in self.on:
            seen = np.sign(seen) * max(abs(seen) - p["half_gap"], 0.0)
        torque, reactions = self.spring(seen), np.zeros(2)
        if "soft_windup" in self.on:
            torque -= p["delta_K"] * p["phi_0"] * np.tanh(seen / p["phi_0"])
        if "mesh_stiffness_variation" in self.on:
            at_motor = p["eps_2"] * np.exp(1j * (2 * x[0] + p["mesh_stiffness_variation_psi_2"]))
            at_load = p["eps_o"] * np.exp(1j * (x[2] + p["psi_o"]))
            torque *= 1 + at_motor.real + at_load.real
            reactions = self.stored(seen) * np.array([(2j * at_motor).real, (1j * at_load).real])
        return torque, reactions

    def gear_torque(self, x, windup, rate, rates):
        """T_g and the torques on motor and load that belong to a varying stiffness."""
        p = self.p
        torque, reactions = self.spring_torque(x, windup)
        if "hysteresis" in self.on:
            zeta = self.hidden("hysteresis", x)[0]
            size = abs(zeta) ** p["loop_sharpness"]
            b = p["hysteresis_beta"]
            lost = b * abs(rate) * size * np.sign(zeta) + (1 - b) * rate * size
            rates[self.places["hysteresis"]] = (rate - lost) / p["phi_h"]
            torque += p["T_h"] * zeta
        if "maxwell_slip" in self.on:
            z = self.hidden("maxwell_slip", x)
            yields = p["maxwell_slip_phi_h"] * np.array([0.25, 0.75, 1.25, 1.75])
            rates[self.places["maxwell_slip"]] = rate * (1 - (z * rate > 0) * z**4) / yields
            torque += p["maxwell_slip_T_h"] * z.mean()
        if "viscoelastic" in self.on:
            stretch = windup - self.hidden("viscoelastic", x)
            rates[self.places["viscoelastic"]] = stretch / np.array([p["tau_short"], p["tau_long"]])
            torque += 0.5 * p["K_v"] * stretch.sum()
        return torque + p["B_sp"] * rate, reactions

    def drive(self, x, rates):
        """Torque on the wave generator and the inertia that turns with it."""
        p, on = self.p, self.on
        torque, inertia, theta, speed = self.command, p["J_m"], x[0], x[1]
        if "delay" in on:
            A, B, C, D = self.pade
            state = self.hidden("delay", x)
            rates[self.places["delay"]] = A @ state + B[:, 0] * torque
            torque = C[0] @ state + D[0, 0] * torque
        if "torque_saturation" in on:
            voltage = p["tau_stall"] * (1 - abs(speed) / p["omega_free"])
            limit = max(min(p["tau_limit"], voltage), 0.0)
            torque = np.clip(torque, -limit, limit)
        if "actuator_lag" in on:
            actual = self.hidden("actuator_lag", x)[0]
            rates[self.places["actuator_lag"]] = (torque - actual) / p["tau_e"]
            torque = actual
        if "torque_gain" in on:
            current = min(abs(torque) / p["tau_peak"], 1.0)
            torque *= (1 + p["gain_error"]) * (1 - p["saturation_share"] * current**2)
        if "torque_ripple" in on:
            electrical = p["pole_pairs"] * theta
            ripple = p["r_2"] * np.cos(2 * electrical + p["torque_ripple_psi_2"])
            ripple += p["r_6"] * np.cos(6 * electrical + p["psi_6"])
            torque = torque * (1 + ripple) + p["tau_off"] * np.cos(electrical + p["torque_ripple_psi_1"])
        if "cogging" in on:
            n = p["cogging_order"]
            torque += p["T_cog"] * np.sin(n * theta + p["cogging_psi_1"])
            torque += p["T_cog_2"] * np.sin(2 * n * theta + p["cogging_psi_2"])
        if "input_compliance" in on:
            twist, rotor_speed = self.hidden("input_compliance", x)
            coupling = p["k_ci"] * twist + p["c_ci"] * (rotor_speed - speed)
            rotor = p["rotor_share"] * inertia
            rates[self.places["input_compliance"]] = rotor_speed - speed, (torque - coupling) / rotor
            torque, inertia = coupling, inertia - rotor
        return torque, inertia

    def damping(self, x, direction):
        """Torques of B_m and B_ml on the motor, as warm and worn as it is; at rest, as it is about to slide."""
        p, drag = self.p, 1.0
        if "asymmetric_friction" in self.on:
            drag *= 1 + p["eps_B"] * (np.sign(x[1]) or direction)
        if "thermal_viscous" in self.on:
            warming = self.hidden("thermal_viscous", x)[0]
            drag *= np.exp(-p["thermal_viscous_beta"] * (p["ambient_temperature"] - 20 + warming))
        if "wear_run_in" in self.on:
            drag *= 1 - p["friction_wear"] * self.worn()
        return drag * p["B_m"] * x[1], drag * p["B_ml"] * (x[1] - p["s"] * x[3])

    def motor_friction(self, x, gear_torque, direction, rates):
        """Resisting torque beyond B_m and B_ml of a motor that slides, or is about to slide, in a direction."""
        p, on, speed = self.p, self.on, x[1]
        factor = 1.0
        if "position_dependent_friction" in on:
            phase = p["position_dependent_friction_order"] * x[0] + p["position_dependent_friction_psi"]
            factor *= 1 + p["friction_ripple"] * np.cos(phase)
        if "wear_run_in" in on:
            factor *= 1 - p["friction_wear"] * self.worn()

        def level(torque, way):
            return factor * torque * (1 + p["eps_c"] * way if "asymmetric_friction" in on else 1)

        dry = total = 0.0
        if "coulomb_friction" in on:
            dry += p["coulomb_friction_T_c"]
        if "stribeck_friction" in on:
            ratio = p["stribeck_friction_breakaway_ratio"]
            fall = np.exp(-(abs(speed / p["stribeck_friction_omega_s"]) ** p["stribeck_shape"]))
            dry += p["stribeck_friction_T_c"] * (1 + (ratio - 1) * fall)
        if "load_dependent_friction" in on:
            driving = gear_torque * direction / p["ratio"] > 0
            dry += p["c_drive" if driving else "c_back"] * abs(gear_torque / p["ratio"])
        total += direction * level(dry, direction)
        if "coulomb_friction_smooth" in on:
            way = np.tanh(speed / p["omega_eps"])
            total += level(p["coulomb_friction_smooth_T_c"], way) * way
        if "presliding_friction" in on:
            z = self.hidden("presliding_friction", x)[0]
            sliding, ratio = p["presliding_friction_T_c"], p["presliding_friction_breakaway_ratio"]
            g = sliding + (ratio * sliding - sliding) * np.exp(-((speed / p["presliding_friction_omega_s"]) ** 2))
            g = level(g, np.sign(speed))
            bending = speed - p["sigma_0"] * abs(speed) * z / g
            damping = p["sigma_1"] / (1 + p["sigma_1"] * abs(speed) / (4 * g))
            rates[self.places["presliding_friction"]] = bending
            total += p["sigma_0"] * z + damping * bending
        if "nonlinear_viscous" in on:
            smoothed = np.hypot(speed, 0.1) / 100
            total += factor * p["drag_torque"] * speed / 100 * smoothed ** (p["drag_power"] - 1)
        if "thermal_viscous" in on:
            on_motor, slip = self.damping(x, direction)
            loss = (total + on_motor) * speed + slip * (speed - p["s"] * x[3])
            cooling = self.hidden("thermal_viscous", x)[0] * p["heat_capacity"] / p["cooling_time"]
            rates[self.places["thermal_viscous"]] = (loss - cooling) / p["heat_capacity"]
        return total

    def output(self, t, x, rates):
        """Torque on the output and the inertia that moves with it."""
        p, on = self.p, self.on
        torque, inertia = self.load, p["J_l"]
        if "load_motor_ripple" in on:
            torque *= 1 + p["load_ripple"] * np.cos(p["load_motor_ripple_order"] * x[2] + p["load_motor_ripple_psi"])
        if "gravity_unbalance" in on:
            torque += p["T_gravity"] * np.sin(x[2] + p["gravity_unbalance_psi"])
        if "external_periodic_torque" in on:
            phase = 2 * np.pi * p["f_external"] * t + p["external_periodic_torque_psi"]
            torque += p["T_external"] * np.sin(phase)
        if "load_compliance" in on:
            twist, far_speed = self.hidden("load_compliance", x)
            coupling = p["K_c"] * twist + p["c_c"] * (x[3] - far_speed)
            far = p["payload_share"] * inertia
            rates[self.places["load_compliance"]] = x[3] - far_speed, (coupling - torque) / far
            torque, inertia = coupling, inertia - far
        return torque, inertia

    def windup(self, x, rates):
        """Windup, its rate, and the local ratio."""
        i = self.p["ratio"]
        error, slope = self.kinematic_error(x, rates)
        local_ratio = 1 / i - slope
        windup, rate = x[0] / i - error - x[2], local_ratio * x[1] - x[3]
        if "base_compliance" in self.on:
            angle, speed = self.hidden("base_compliance", x)
            windup, rate = windup + (i - 1) / i * angle, rate + (i - 1) / i * speed
        return windup, rate, local_ratio

    def overload(self, x):
        """What is left before the coupling slips or the teeth jump, and the state after it."""
        p, after, unused = self.p, x.copy(), np.zeros(self.size)
        windup = self.windup(x, unused)[0]
        tau_s = self.spring_torque(x, windup)[0]
        if "coupling_slip" in self.on:
            place = self.places["coupling_slip"]
            after[place] = (1 - p["relief"]) * x[place] + p["relief"] * windup
            return p["T_slip"] - abs(tau_s), after
        place = self.places["ratcheting"]
        (jumped, riding), pitch = x[place], 2 * np.pi / p["spline_teeth"]
        if not riding:
            after[place] = jumped, np.sign(tau_s)
            return p["T_rat"] - abs(tau_s), after
        ridden = riding * (windup - jumped)
        after[place] = jumped + (riding * pitch if ridden > pitch / 2 else 0.0), 0.0
        return min(ridden, pitch - ridden), after

    def balance(self, t, x, directions):
        """Rates with shafts sliding in given directions (0: held), and for each shaft its net torque.

        The bands of what holds a shaft are functions: few moments ask for them, and only of a shaft that can stick.
        """
        p = self.p
        rates = np.zeros(self.size)
        i = p["ratio"]
        windup, rate, local_ratio = self.windup(x, rates)
        T_g, reactions = self.gear_torque(x, windup, rate, rates)
        torque, inertia = self.drive(x, rates)
        load, far_inertia = self.output(t, x, rates)
        on_motor, slip = self.damping(x, directions[0])
        net_m = torque - on_motor - slip - local_ratio * T_g - reactions[0]
        net_l = T_g - p["B_l"] * x[3] + p["s"] * slip - load - reactions[1]
        holding = p["T_cl"] if "load_side_friction" in self.on else 0.0
        bands = [
            lambda: [
                self.motor_friction(x, T_g, d, np.zeros(self.size)) + sum(self.damping(x, d)) - on_motor - slip
                for d in (-1, 1)
            ],
            lambda: [-holding, holding],
        ]
        resisting = [self.motor_friction(x, T_g, directions[0], rates), directions[1] * holding]
        rates[0], rates[2] = x[1], x[3]
        rates[1] = (net_m - resisting[0]) / inertia if directions[0] else 0.0
        rates[3] = (net_l - resisting[1]) / far_inertia if directions[1] else 0.0
        if "base_compliance" in self.on:
            angle, speed = self.hidden("base_compliance", x)
            pull = (i - 1) / i * T_g
            if "rotor_unbalance_reaction" in self.on:
                pull -= p["unbalance"] * x[1] ** 2 * np.cos(x[0] + p["rotor_unbalance_reaction_psi"])
            acceleration = (-pull - p["k_b"] * angle - p["c_b"] * speed) / p["J_b"]
            rates[self.places["base_compliance"]] = speed, acceleration
        return rates, (net_m, net_l), bands

    def sticky(self):
        """Whether motor and output can stick."""
        return bool(DRY_MOTOR & self.on), "load_side_friction" in self.on

    def start(self):
        """At rest, motor and output at zero angle; hidden states as the load torque has wound them up."""
        p, load, x = self.p, self.load, np.zeros(self.size)
        held = load * (1 / p["ratio"] - self.kinematic_error(x, np.zeros(self.size))[1])
        wound = {
            "viscoelastic": lambda: brentq(lambda windup: self.spring(windup) - load, -0.1, 0.1, xtol=1e-18),
            "actuator_lag": lambda: held,
            "delay": lambda: -held * np.linalg.solve(self.pade[0], self.pade[1][:, 0]),
            "input_compliance": lambda: (held / p["k_ci"], 0.0),
            "load_compliance": lambda: (load / p["K_c"], 0.0),
            "base_compliance": lambda: ((1 / p["ratio"] - 1) * load / p["k_b"], 0.0),
        }
        for term in wound.keys() & self.on:
            x[self.places[term]] = wound[term]()
        return x

    def solve(self, t_eval, torques, method="DOP853", rtol=1e-11, max_step=2e-3):
        """theta_m, omega_m, theta_l, omega_l at the given times, from rest; `torques` = (until, motor torque), ..."""
        sticky = self.sticky()
        scales = np.full(self.size, 1e-3)
        scales[[0, 1, 2, 3]] = 1e-2, 1e-2, 1e-5, 1e-4
        x, out = self.start(), np.full((4, len(t_eval)), np.nan)
        t, directions = t_eval[0], (0, 0)
        overloaded = []
        if {"coupling_slip", "ratcheting"} & self.on:

            def overload(t, x):
                return self.overload(x)[0]

            overload.terminal, overload.direction = True, -1
            overloaded = [overload]
        for end, self.command in torques:
            directions = self.directions(t, x, sticky, directions)
            while t < end:
                part = solve_ivp(
                    lambda t, x, d=directions: self.balance(t, x, d)[0],
                    (t, end),
                    x,
                    method=method,
                    rtol=rtol,
                    atol=rtol * scales,
                    dense_output=True,
                    max_step=max_step,
                    events=self.events(sticky, directions) + overloaded,
                )
                inside = (t_eval >= t) & (t_eval <= part.t[-1])
                if inside.any():
                    out[:, inside] = part.sol(t_eval[inside])[:4]
                t, x = part.t[-1], part.y[:, -1].copy()
                if part.status == 1:
                    if overloaded and len(part.t_events[-1]):
                        x = self.overload(x)[1]
                    for shaft in (0, 1):
                        if sticky[shaft] and abs(x[1 + 2 * shaft]) < 1e-7 * (1 if shaft == 0 else 1e-2):
                            x[1 + 2 * shaft] = 0.0
                    directions = self.directions(t, x, sticky, directions)
        return out

    def directions(self, t, x, sticky, before):
        """The way each shaft goes on from here."""
        _, nets, bands = self.balance(t, x, before)
        found = []
        for shaft in (0, 1):
            speed = x[1 + 2 * shaft]
            if not sticky[shaft]:
                found.append(1)
            elif speed != 0:
                found.append(int(np.sign(speed)))
            else:
                net, (low, high) = nets[shaft], bands[shaft]()
                slack = 1e-9 * max(abs(low), abs(high))
                held = low + slack < net < high - slack
                found.append(0 if held else int(np.sign(net - 0.5 * (low + high))))
        return tuple(found)

    def events(self, sticky, directions):
        """Stops and breakaways of the shafts that can stick."""
        found = []
        for shaft, way in enumerate(directions):
            if not sticky[shaft]:
                continue

            def stop(t, x, shaft=shaft):
                return x[1 + 2 * shaft]

            def pulled(t, x, shaft=shaft):
                _, nets, bands = self.balance(t, x, directions)
                return bands[shaft]()[1] - nets[shaft]

            def pushed(t, x, shaft=shaft):
                _, nets, bands = self.balance(t, x, directions)
                return nets[shaft] - bands[shaft]()[0]

            for event in (stop,) if way else (pulled, pushed):
                event.terminal = True
                event.direction = -way if way else -1
                found.append(event)
        return found
