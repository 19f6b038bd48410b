"""What is done to the drive: torque, speed reference, prescribed motion and load over time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hdfast import checks
from hdfast.checks import Floats
from hdfast.errors import InputError, choose, shorten
from hdfast.scenario_parts import (
    K_I,
    K_P,
    MAX_SPEED_RPM,
    MAX_TIME,
    MAX_TORQUE,
    RPM,
    T_BRAKE,
    T_RAMP,
    TAU_MAX,
    down_from_one,
    load_tracks,
    motion_spline,
    pair,
    ramp_time,
    ramp_up_then_zero,
    ring_window,
    run_phase,
    scenario_values,
    torque_track,
    typical_speed,
    without_meaning,
)
from hdfast.segments import KIND, MOTION, SPEED, TORQUE, assemble, held, linear

STARTS = ("torque_step", "speed_ramp")
STOPS = ("coast", "brake")
INITIALS = ("relaxed", "zero_angle")
COAST_RING = (1.5, 1.4, False)
BRAKE_RING = (0.1, 0.5, True)

Load = float | tuple[Any, Any]


@dataclass(frozen=True, eq=False)
class Scenario:
    """Inputs over time, made by `start_stop`, `speed_profile`, `torque_profile`, `motion` or `replay`.

    Attributes:
        name: the constructor, for reports.
        segments: (n, 21) table of piecewise inputs as the core takes it.
        t_on, t_off, t_end: begin of the start phase, end of the run phase, end of the run [s].
        t_run: begin of the run phase [s]; NaN lets the core take the last whole number of revolutions.
        initial: "relaxed" or "zero_angle".
        values: default of each scenario column: omega_set [rad/s], tau_load [N m], K_p, K_i, tau_max [N m],
            theta_m0 [rad].
        ring_delay, ring_width: window of the residual ring after t_off [s].
        ring_on_load: residual ring of the load speed instead of the windup rate.
    """

    name: str
    segments: Floats = field(repr=False)
    t_on: float
    t_off: float
    t_end: float
    t_run: float
    initial: str
    values: Mapping[str, float]
    ring_delay: float
    ring_width: float
    ring_on_load: bool

    @property
    def idle(self) -> dict[str, str]:
        """Scenario columns that change nothing here, each with the reason."""
        found = {}
        if np.all(self.segments[:, KIND] == MOTION):
            found["theta_m0"] = f"in {self.name}, which prescribes the angle"
        elif self.initial == "zero_angle":
            found["theta_m0"] = "with initial = 'zero_angle'"
        if not np.any(self.segments[:, KIND] == SPEED):
            found |= dict.fromkeys(("K_p", "K_i", "tau_max"), f"in {self.name}, which has no speed controller")
        return found

    @classmethod
    def start_stop(
        cls,
        *,
        speed_rpm: float = 100.0,
        start: str = "torque_step",
        stop: str | None = "coast",
        t_on: float = 0.0,
        t_off: float | None = None,
        t_end: float = 6.0,
        t_ramp: float | None = None,
        t_brake: float | None = None,
        torque: float | None = None,
        torque_ramp: float | None = None,
        load: Load = 0.0,
        K_p: float | None = None,
        K_i: float | None = None,
        tau_max: float | None = None,
        initial: str = "relaxed",
        theta_m0: float = 0.0,
        run_window: tuple[float, float] | None = None,
        ring_delay: float | None = None,
        ring_width: float | None = None,
    ) -> Scenario:
        """Start, run and stop of a drive.

        Args:
            speed_rpm: set speed of the motor [r/min]; the default of the column `omega_set`.
            start: "torque_step" applies the mean motor torque that sustains the set speed against damping, load and
                the friction of all terms (as warm as the drive begins; a drive that delivers another torque than asked,
                by `torque_gain` say, misses the speed), "speed_ramp" lets the PI controller follow a linear reference.
                Both begin with the motor torque that holds the load torque of the start, "speed_ramp" by the integrator
                of its controller: not with K_i = 0, and from an `initial_state` only with the z that does.
            stop: "coast" (no motor torque), "brake" (PI controller, reference to zero) or None (run on).
            t_on: start of the motion [s]. Until then a "torque_step" keeps the torque it begins with: a load that
                changes, or torques of terms, gravity say, move the drive before. The kinematic error makes every other
                angle an unstable rest of a loaded drive without friction: held for seconds, it creeps away.
            t_off: begin of the stop [s]; default half of t_end, or t_end without a stop.
            t_end: end of the run [s].
            t_ramp: duration of the reference ramp of "speed_ramp" [s]; default 0.2, at most to t_off.
            t_brake: duration of the reference ramp of "brake" [s]; default 0.02, at most to t_end.
            torque: motor torque of "torque_step" [N m] in place of the sustaining torque.
            torque_ramp: duration over which "torque_step" goes over to its torque [s]; default 0, a step.
            load: constant load torque [N m], positive resists, the default of the column `tau_load`; or a table
                (t [s], torque [N m]) added to that column and not covered by the sustaining torque.
            K_p: proportional gain of the PI controller [N m s/rad]; default 0.05.
            K_i: its integral gain [N m/rad]; default 0.8.
            tau_max: its torque limit [N m]; default 2, may be infinite.
            initial: "relaxed" (in equilibrium with the load torque, which has long wound up spring, couplings and
                housing, so that nothing creeps; torques of terms, gravity say, gaps or soft ends of the spring and
                `mesh_stiffness_variation` then set the load swinging, and `torque_gain`, which holds another torque
                than asked, moves the drive) or "zero_angle" (both angles zero; neither terms nor motor hold a load).
            theta_m0: motor angle at t = 0 [rad] of a relaxed start; of "zero_angle" 0.
            run_window: (begin, end) of the run phase [s]; the end is t_off. By default it holds the last whole
                revolutions of the set speed that last half a second, also where the drive misses that speed;
                `steady_speed` and the orders look for the revolutions it turned, the orders no further back than four
                such phases, also where another one is given: further below the set speed they are NaN.
            ring_delay: delay of the residual-ring window after t_off [s]; default 1.5 (coast) or 0.1 (brake).
            ring_width: its width [s]; default 1.4 (coast) or 0.5 (brake).

        Raises:
            InputError: naming the argument, its value and the allowed range, also of one that start and stop leave
                without a meaning.
        """
        choose("start", start, STARTS)
        if stop is not None:
            choose("stop", stop, STOPS)
        if start == "torque_step":
            without_meaning(f"start={start!r}", t_ramp=t_ramp)
        else:
            without_meaning(f"start={start!r}", torque=torque, torque_ramp=torque_ramp)
        if stop != "brake":
            without_meaning(f"stop={stop!r}", t_brake=t_brake)
            if start == "torque_step":
                without_meaning(f"start={start!r}, stop={stop!r}", K_p=K_p, K_i=K_i, tau_max=tau_max)
        t_end = checks.positive("t_end", t_end, MAX_TIME, "s")
        t_on = checks.number("t_on", t_on, 0.0, t_end, "s")
        marks = run_phase(run_window, t_on, t_off, t_end, t_end / 2.0 if stop else t_end)
        off = marks[0]
        tracks = dict(load_tracks(load, held_between=False))
        opening = TORQUE
        if start == "torque_step":
            ramp = 0.0 if torque_ramp is None else checks.number("torque_ramp", torque_ramp, 0.0, off - t_on, "s")
            level = 1.0 if torque is None else checks.finite("torque", torque, -MAX_TORQUE, MAX_TORQUE, "N m")
            tracks["sustain" if torque is None else "torque"] = ramp_up_then_zero(t_on, ramp, level, off)
            tracks["hold"] = down_from_one(t_on, ramp)
        else:
            opening = SPEED
        phases = [(0.0, opening, False)]
        reference: list[tuple[float, float]] = []
        if start == "speed_ramp":
            ramp = ramp_time("t_ramp", t_ramp, T_RAMP, off - t_on)
            reference = [(t_on, 0.0), (t_on + ramp, 1.0)]
        if stop == "brake":
            brake = ramp_time("t_brake", t_brake, T_BRAKE, t_end - off)
            reference = [*(reference or [(0.0, 1.0)]), (off, 1.0), (off + brake, 0.0)]
            phases.append((off, SPEED, start == "torque_step"))
        elif stop == "coast":
            phases.append((off, TORQUE, False))
        if reference:
            corners = np.array(reference)
            tracks["set_speed"] = linear(corners[:, 0], corners[:, 1])
        K_p, K_i, tau_max = (
            default if given is None else given for given, default in ((K_p, K_P), (K_i, K_I), (tau_max, TAU_MAX))
        )
        return cls._make(
            f"start_stop({start}, {stop})",
            assemble(t_end, phases, tracks),
            (t_on, *marks, t_end),
            initial,
            scenario_values(speed_rpm, load, K_p, K_i, tau_max, theta_m0),
            ring_window(BRAKE_RING if stop == "brake" else COAST_RING, ring_delay, ring_width),
        )

    @classmethod
    def speed_profile(
        cls,
        t: Any,
        speed_rpm: Any = None,
        *,
        speed: Any = None,
        relative: Any = None,
        hold: bool = False,
        set_speed_rpm: float | None = None,
        t_on: float | None = None,
        t_off: float | None = None,
        t_end: float | None = None,
        load: Load = 0.0,
        K_p: float = K_P,
        K_i: float = K_I,
        tau_max: float = TAU_MAX,
        initial: str = "relaxed",
        theta_m0: float = 0.0,
        run_window: tuple[float, float] | None = None,
        ring_delay: float | None = None,
        ring_width: float | None = None,
    ) -> Scenario:
        """PI speed control following a table. Give exactly one of `speed_rpm`, `speed` and `relative`.

        Args:
            t: times of the table [s], not decreasing, from 0 on; two equal times make a jump.
            speed_rpm: motor speed at those times [r/min].
            speed: the same in rad/s.
            relative: the same in multiples of the column `omega_set`, so that rows may differ in speed.
            hold: False joins the samples by straight lines, True holds each until the next.
            set_speed_rpm: default of the column `omega_set` [r/min]; by default the largest speed of the table, or 100
                with `relative`.
            t_on: begin of the start phase [s]; default the first time of the table.
            t_off: end of the run phase [s]; default the last sample of largest speed, with `hold` the end of that
                sample: the time of the next, or t_end.
            t_end: end of the run [s]; default the last time of the table.
            load, K_p, K_i, tau_max, initial, theta_m0, run_window, ring_delay, ring_width: as in `start_stop`.

        Raises:
            InputError: naming the argument, its value and the allowed range.
        """
        checks.flag("hold", hold)
        given = {"speed_rpm": speed_rpm, "speed": speed, "relative": relative}
        chosen = [name for name, value in given.items() if value is not None]
        if len(chosen) != 1:
            raise InputError(
                f"give exactly one of speed_rpm, speed and relative (given: {', '.join(chosen) or 'none'})"
            )
        limits = {"speed_rpm": MAX_SPEED_RPM, "speed": MAX_SPEED_RPM * RPM, "relative": 1e6}
        t, values = pair("t", t, chosen[0], given[chosen[0]], limits[chosen[0]])
        values = values * RPM if speed_rpm is not None else values
        peak = float(np.max(np.abs(values)))
        end = checks.positive("t_end", t[-1] if t_end is None else t_end, MAX_TIME, "s")
        last = int(np.flatnonzero(np.abs(values) >= peak)[-1])
        last_fast = float(np.append(t, end)[last + 1 if hold else last])
        on = checks.number("t_on", t[0] if t_on is None else t_on, 0.0, end, "s")
        marks = run_phase(run_window, on, t_off, end, last_fast if on < last_fast <= end else end)
        if set_speed_rpm is None:
            set_speed_rpm = 100.0 if relative is not None else peak / RPM
        tracks = dict(load_tracks(load, held_between=hold))
        tracks["set_speed" if relative is not None else "reference"] = (held if hold else linear)(t, values)
        return cls._make(
            "speed_profile",
            assemble(end, [(0.0, SPEED, False)], tracks),
            (on, *marks, end),
            initial,
            scenario_values(set_speed_rpm, load, K_p, K_i, tau_max, theta_m0),
            ring_window(COAST_RING, ring_delay, ring_width),
        )

    @classmethod
    def torque_profile(
        cls,
        t: Any,
        torque: Any,
        *,
        hold: bool = False,
        speed_rpm: float = 100.0,
        t_on: float | None = None,
        t_off: float | None = None,
        t_end: float | None = None,
        load: Load = 0.0,
        initial: str = "relaxed",
        theta_m0: float = 0.0,
        run_window: tuple[float, float] | None = None,
        ring_delay: float | None = None,
        ring_width: float | None = None,
    ) -> Scenario:
        """Motor torque from a table.

        Args:
            t: times of the table [s], not decreasing, from 0 on; two equal times make a jump.
            torque: motor torque at those times [N m]; nothing else holds a load, though a lag or a coupling of the
                motor begins with what would.
            hold: False joins the samples by straight lines, True holds each until the next.
            speed_rpm: expected speed [r/min]; used only to place the run phase on whole revolutions.
            t_on: begin of the start phase [s]; default the first time of the table.
            t_off: end of the run phase [s]; default t_end.
            t_end: end of the run [s]; default the last time of the table.
            load, initial, theta_m0, run_window, ring_delay, ring_width: as in `start_stop`.

        Raises:
            InputError: naming the argument, its value and the allowed range.
        """
        checks.flag("hold", hold)
        t, values = pair("t", t, "torque", torque, MAX_TORQUE)
        end = checks.positive("t_end", t[-1] if t_end is None else t_end, MAX_TIME, "s")
        on = checks.number("t_on", t[0] if t_on is None else t_on, 0.0, end, "s")
        marks = run_phase(run_window, on, t_off, end, end)
        tracks = dict(load_tracks(load, held_between=hold))
        tracks["torque"] = (held if hold else linear)(t, values)
        return cls._make(
            "torque_profile",
            assemble(end, [(0.0, TORQUE, False)], tracks),
            (on, *marks, end),
            initial,
            scenario_values(speed_rpm, load, K_P, K_I, TAU_MAX, theta_m0),
            ring_window(COAST_RING, ring_delay, ring_width),
        )

    @classmethod
    def motion(
        cls,
        t: Any,
        theta_m: Any,
        *,
        smoothing: float | str | None = None,
        torque: tuple[Any, Any] | None = None,
        hold: bool = False,
        speed_rpm: float | None = None,
        t_on: float | None = None,
        t_off: float | None = None,
        t_end: float | None = None,
        load: Load = 0.0,
        initial: str = "relaxed",
        run_window: tuple[float, float] | None = None,
        ring_delay: float | None = None,
        ring_width: float | None = None,
    ) -> Scenario:
        """Prescribed motor motion: angle, speed and acceleration from one cubic spline.

        Args:
            t: times of the samples [s], strictly increasing from 0, at least 5.
            theta_m: motor angle at those times, unwrapped [rad].
            smoothing: None passes through every sample; "auto" smooths by generalised cross-validation; a number is the
                weight of the squared second derivative (`scipy.interpolate.make_smoothing_spline`) [s^3].
            torque: motor torque asked of the drive meanwhile, a table (t [s], torque [N m]); it moves nothing, the
                signal `tau_drive` is what the drive makes of it.
            hold: False joins the samples of torque and load by straight lines, True holds each until the next.
            speed_rpm: expected speed [r/min], used to place the run phase; default the fastest tenth of the motion.
            t_on: begin of the start phase [s]; default 0.
            t_off: end of the run phase [s]; default t_end.
            t_end: end of the run [s], at most the last sample; default the last sample.
            load, initial, run_window, ring_delay, ring_width: as in `start_stop`.

        Raises:
            InputError: naming the argument, its value and the allowed range.
        """
        checks.flag("hold", hold)
        t = checks.times("t", t, MAX_TIME)
        angle = checks.table("theta_m", theta_m)
        if len(t) != len(angle) or len(t) < 5 or t[0] != 0.0:
            raise InputError(
                f"t and theta_m have {len(t)} and {len(angle)} samples from t = {t[0]:g} s "
                f"(allowed: 5 or more of each, from 0 s)"
            )
        end = checks.positive("t_end", t[-1] if t_end is None else t_end, float(t[-1]), "s")
        on = checks.number("t_on", 0.0 if t_on is None else t_on, 0.0, end, "s")
        marks = run_phase(run_window, on, t_off, end, end)
        spline = motion_spline(t, angle, smoothing)
        tracks = load_tracks(load, held_between=hold) | torque_track(torque, held_between=hold)
        if speed_rpm is None:
            speed_rpm = typical_speed(t, angle) / RPM
        return cls._make(
            "motion",
            assemble(end, [(0.0, MOTION, False)], tracks, spline),
            (on, *marks, end),
            initial,
            scenario_values(speed_rpm, load, K_P, K_I, TAU_MAX, float(spline(0.0))),
            ring_window(COAST_RING, ring_delay, ring_width),
        )

    @classmethod
    def replay(
        cls,
        recording: Any,
        *,
        input: str = "motor_torque",  # noqa: A002 - the name of the interface
        hold: bool = False,
        **options: Any,
    ) -> Scenario:
        """Replay a recording: its motor torque, its motor motion or its speed reference, with its load torque.

        Args:
            recording: mapping or table with the columns `t` [s] and, depending on `input`, `motor_torque` [N m],
                `motor_angle` [rad] or `speed_reference` [rad/s]; `load_torque` [N m] is used when present, with
                "motor_motion" also `motor_torque` as the torque asked of the drive (signal `tau_drive`). A
                `motor_angle` is where the motor starts (`theta_m0`), with "motor_torque" also its expected speed. Time
                starts at the first sample; samples that are NaN are bridged.
            input: "motor_torque", "motor_motion" or "reference".
            hold: hold samples instead of joining them by straight lines; the angle of a motion is always a spline.
            options: `max_gap` [s], the longest stretch without samples (default 20 times the median step), and the
                arguments of `torque_profile`, `motion` or `speed_profile`.

        Raises:
            InputError: a column is missing, a gap is too long, or an option is wrong.
        """
        from hdfast.recordings.replay import replay

        return replay(cls, recording, input, hold, options)

    @classmethod
    def _make(
        cls,
        name: str,
        segments: Floats,
        marks: tuple[float, float, float, float],
        initial: str,
        values: dict[str, float],
        ring: tuple[float, float, bool],
    ) -> Scenario:
        choose("initial", initial, INITIALS)
        angle = values["theta_m0"]
        if initial == "zero_angle" and angle != 0.0 and name != "motion":
            raise InputError(f"theta_m0 = {angle:g} rad has no meaning with initial={initial!r} (allowed: 0 rad)")
        t_on, t_off, t_run, t_end = marks
        return cls(name, segments, t_on, t_off, t_end, t_run, initial, values, *ring)


def chosen_scenario(scenario: Scenario | None) -> Scenario:
    """The scenario given, or the default."""
    if scenario is None:
        return Scenario.start_stop()
    if not isinstance(scenario, Scenario):
        raise InputError(f"scenario = {shorten(scenario)} is not a hdfast.Scenario")
    return scenario
