"""The mix of cases of the first release: 300 recipes, and smaller sets in the same proportions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hdfast.proof.generator.recipe import Bench, Recipe

FULL = 300
HIDDEN = (1.5, 2.0, 3.0, 3.0, 4.0)
MOTOR = Bench(motor_only=True)
STIFF = Bench(stiff=True)
COARSE = Bench(noise=2.5)
QUIET = Bench(noise=0.6)
COARSE_MOTOR = Bench(motor_only=True, noise=2.0)
FAST = Bench(fast=True)
STEADY = Bench(programme="steady", load="none")
STEADY_LOADED = Bench(programme="steady", load="constant")
POOR = Bench(programme="poor")
ONE_WAY = Bench(programme="one_way")

# effect -> benches on which a refit swallows most of it
ABSORBED: dict[str, tuple[Bench, ...]] = {
    "coulomb_friction": (ONE_WAY,),
    "stribeck_friction": (POOR,),
    "load_dependent_friction": (ONE_WAY, POOR),
    "load_side_friction": (ONE_WAY,),
    "thermal_viscous": (replace(POOR, warm=True),),
    "hysteresis": (POOR,),
    "load_compliance": (POOR,),
}

# effect -> (ways of concealment, bench, amplitudes) beyond the absorbed ones
OPEN: dict[str, tuple[tuple[str, Bench, tuple[float, ...]], ...]] = {
    "coulomb_friction": (("", MOTOR, (3.0, 8.0)), ("masked_by_controller", STIFF, (1.5, 3.0, 8.0))),
    "stribeck_friction": (("", MOTOR, (3.0, 8.0)), ("masked_by_controller", STIFF, (3.0, 8.0))),
    "load_dependent_friction": (
        ("", Bench(), (0.7, 8.0)), ("", FAST, (3.0,)), ("masked_by_controller", STIFF, (3.0,)),
    ),
    "load_side_friction": (("", MOTOR, (3.0,)), ("masked_by_controller", STIFF, (1.5, 3.0, 8.0))),
    "thermal_viscous": (("", replace(MOTOR, warm=True), (3.0, 8.0)), ("", Bench(warm=True), (0.7, 8.0))),
    "position_dependent_friction": (
        ("", Bench(), (0.7, 1.5, 3.0, 3.0, 8.0)), ("", MOTOR, (3.0,)), ("", COARSE_MOTOR, (8.0,)),
        ("masked_by_noise", COARSE, (1.5, 1.5, 1.5)),
    ),
    "hysteresis": (("", Bench(), (0.7, 3.0)), ("", QUIET, (8.0,)), ("masked_by_noise", COARSE, (1.5,))),
    "backlash": (
        ("", Bench(), (0.7, 1.5, 3.0, 8.0, 8.0)), ("", FAST, (3.0,)), ("masked_by_noise", COARSE, (1.5, 1.5, 1.5, 3.0)),
    ),
    "mesh_stiffness_variation": (
        ("", Bench(), (0.7, 1.5, 3.0, 8.0)), ("", FAST, (3.0,)), ("", QUIET, (8.0,)),
        ("masked_by_noise", COARSE, (1.5, 1.5, 1.5, 3.0)),
    ),
    "te_harmonic": (
        ("", Bench(), (0.7, 3.0)), ("", STEADY_LOADED, (8.0,)), ("masked_by_noise", COARSE, (1.5, 1.5)),
        ("masked_by_sampling", FAST, (3.0, 3.0, 8.0, 8.0, 8.0)),
    ),
    "torque_ripple": (
        ("", Bench(), (3.0,)), ("", MOTOR, (0.7, 1.5, 3.0, 3.0, 8.0)), ("", COARSE_MOTOR, (8.0,)),
        ("masked_by_controller", STIFF, (1.5, 3.0, 8.0)),
    ),
    "load_compliance": (("", Bench(), (0.7, 3.0, 8.0)), ("masked_by_noise", COARSE, (1.5,))),
}  # fmt: skip

ABSORBED_COUNTS = {
    "coulomb_friction": 5, "stribeck_friction": 6, "load_dependent_friction": 6, "load_side_friction": 6,
    "thermal_viscous": 6, "hysteresis": 6, "load_compliance": 6,
}  # fmt: skip

SETS: tuple[dict[str, float], ...] = (
    {"coulomb_friction": 5.0, "load_dependent_friction": 5.0},
    {"stribeck_friction": 8.0, "position_dependent_friction": 4.0},
    {"hysteresis": 8.0, "backlash": 8.0},
    {"coulomb_friction": 6.0, "thermal_viscous": 6.0},
    {"load_side_friction": 5.0, "hysteresis": 6.0},
    {"mesh_stiffness_variation": 5.0, "te_harmonic": 4.0},
    {"torque_ripple": 4.0, "te_harmonic": 4.0},
    {"load_compliance": 5.0, "backlash": 5.0},
    {"coulomb_friction": 5.0, "torque_ripple": 5.0},
    {"stribeck_friction": 8.0, "hysteresis": 8.0},
    {"load_dependent_friction": 6.0, "te_load_dependence": 6.0},
    {"viscoelastic": 6.0, "soft_windup": 6.0},
    {"cogging": 4.0, "nonlinear_viscous": 5.0},
    {"coulomb_friction": 5.0, "hysteresis": 6.0, "te_harmonic": 4.0},
    {"gravity_unbalance": 5.0, "coulomb_friction": 6.0, "torque_ripple": 5.0},
)
SENSORS = ("encoder_eccentricity", "sensor_lowpass", "sensor_delay", "clock_skew", "sensor_offset_drift")
OUTSIDE = ("outside_detent", "outside_thixotropy", "outside_slosh", "outside_end_spring")
FAST_SETS = (2, 19)  # of the thirty
FAST_SENSOR, FAST_OUTSIDE = ("sensor_delay", 8.0), "outside_end_spring"
TWINS: tuple[tuple[str, Bench], ...] = (
    ("coulomb_friction", MOTOR),
    ("encoder_eccentricity", STEADY),
    ("mesh_stiffness_variation", STEADY_LOADED),
    ("ratio_error", STEADY),
)
MOTOR_NULLS, OTHER_NULLS = 34, 66


def plan(count: int, seed: int) -> list[Recipe]:
    """Recipes of a set of `count` cases (at most 300), shuffled; every stratum keeps its share."""
    whole = _first_release()
    chosen = [whole[k * FULL // count] for k in range(count)]
    rng = np.random.default_rng(seed)
    seeds = rng.integers(0, 2**62, count)
    order = rng.permutation(count)
    return [replace(chosen[k], seed=int(seeds[k])) for k in order]


def _first_release() -> list[Recipe]:
    sets = [_recipe(("set",), SETS[k % len(SETS)], _bench_of_set(k)) for k in range(30)]
    sensors = [
        _recipe(("sensor_only",), {i: m}, FAST if (i, m) == FAST_SENSOR else Bench())
        for i in SENSORS
        for m in (3.0, 8.0)
    ]
    outside = [
        _recipe(("outside",), {i: m}, _bench_of_outside(i, k))
        for i in OUTSIDE
        for k, m in enumerate((8.0, 3.0, 3.0, 8.0, 8.0))
    ]
    twins = [_recipe(("undecidable",), {i: m}, bench) for i, bench in TWINS for m in (3.0, 3.0, 8.0, 8.0, 8.0)]
    concealing = _singles() + sets + sensors + outside + twins
    motor = [one for one in concealing if one.bench.motor_only]
    others = [one for one in concealing if not one.bench.motor_only]
    alike = [motor[k % len(motor)] for k in range(MOTOR_NULLS)]
    alike += [others[k * len(others) // OTHER_NULLS] for k in range(OTHER_NULLS)]
    return [Recipe(("null",), {}, 0, like.bench, like) for like in alike] + concealing


def _bench_of_set(k: int) -> Bench:
    return FAST if k in FAST_SETS else Bench(warm="thermal_viscous" in SETS[k % len(SETS)])


def _bench_of_outside(effect_id: str, k: int) -> Bench:
    if k == 4:
        return FAST if effect_id == FAST_OUTSIDE else Bench()
    return MOTOR if effect_id in ("outside_detent", "outside_thixotropy") else Bench()


def _singles() -> list[Recipe]:
    out = []
    for effect_id, parts in OPEN.items():
        for k in range(ABSORBED_COUNTS.get(effect_id, 0)):
            benches = ABSORBED[effect_id]
            out.append(_recipe(("single", "absorbed"), {effect_id: HIDDEN[k % len(HIDDEN)]}, benches[k % len(benches)]))
        for way, bench, sizes in parts:
            kinds = ("single", way) if way else ("single",)
            out += [_recipe(kinds, {effect_id: size}, bench) for size in sizes]
    return out


def _recipe(kinds: tuple[str, ...], effects: dict[str, float], bench: Bench) -> Recipe:
    return Recipe(kinds, effects, 0, bench)
