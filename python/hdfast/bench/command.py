"""The command `hdfast bench`."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import asdict, replace
from itertools import product
from typing import Any

from hdfast import bench, checks
from hdfast.bench import folder
from hdfast.bench.rig import SENSORS, rig
from hdfast.checks import MAX_SEED
from hdfast.config import Config, load
from hdfast.errors import InputError
from hdfast.files import TRUTH, prepare_own
from hdfast.model import Model
from hdfast.printing import json_text
from hdfast.recordings import Recording
from hdfast.sensors import SensorStage, encoder
from hdfast.sensors.catalogue import EFFECTS
from hdfast.sensors.facts import KEYS

NAME = "bench"
TEXT = "Make the recordings a test rig would give of a known drive, through its sensors."
EXAMPLE = "hdfast bench stiffness examples/shf-25-120.toml --out out/bench-stiffness"
KINDS = {
    "stiffness": "torque-windup loop at the locked input (quasi-static, the file's spring with slip elements)",
    "kinematic-error": "slow runs at constant speed in both directions",
    "startstop": "the file's scenario",
    "friction": "ladder of constant speeds (rigid, with dry friction)",
    "starting-torque": "slow torque ramps out of rest at twelve angles (rigid, with dry friction)",
    "coastdown": "coasting to rest (rigid, with dry friction)",
}
LOAD_ANGLE = ("stiffness", "kinematic-error", "startstop")  # kinds that record it
OUTPUT_TORQUE = (*LOAD_ANGLE, "friction")
GIVEN = "(default: %(default)s)"
DRY, T_C, AT_REST = "coulomb_friction", 0.03, 4.0 / 3.0
KNOWN = {"stiffness": (), "friction": (DRY,), "starting-torque": (DRY,), "coastdown": (DRY,)}


def arguments(command: argparse.ArgumentParser, whole: Callable[[str, int, int], Any]) -> None:
    """Declare the arguments; `whole` makes a reader of whole numbers."""
    kinds = command.add_subparsers(dest="kind", metavar="KIND", required=True)
    for kind, text in KINDS.items():
        example = f"example:\n  hdfast bench {kind} examples/shf-25-120.toml --out out/bench-{kind}"
        shape = argparse.RawDescriptionHelpFormatter
        part = kinds.add_parser(kind, help=text, description=text, epilog=example, formatter_class=shape)
        part.add_argument("file", metavar="FILE.toml", help="the drive")
        part.add_argument("--out", metavar="DIR", required=True, help="folder for recordings, campaign file and page")
        part.add_argument(
            "--seed", type=whole("--seed", 0, MAX_SEED), default=1, help=f"seed of noise and positions {GIVEN}"
        )
        part.add_argument("--rate", type=float, default=1000.0, help=f"samples per second {GIVEN}")
        part.add_argument(
            "--motor-bits",
            type=whole("--motor-bits", 1, 40),
            help="bits of the motor encoder (default: the file's, else 17)",
        )
        part.set_defaults(load_bits=None, angle_noise=None, torque_noise=None, delay=None)
        if kind in LOAD_ANGLE:
            part.add_argument(
                "--load-bits",
                type=whole("--load-bits", 1, 40),
                help="bits of the load encoder (default: the file's, else 20)",
            )
            part.add_argument(
                "--angle-noise", type=float, help="noise of the load angle [rad] (default: the file's, else 1e-6)"
            )
            part.add_argument("--delay", type=float, help="lag of the load angle [s] (default: the file's, else 0)")
        if kind in OUTPUT_TORQUE:
            part.add_argument(
                "--torque-noise",
                type=float,
                help="noise of the torques at the output [N m] (default: the file's, else 0.05)",
            )
        part.add_argument(
            "--format", choices=("parquet", "csv", "npz"), default="parquet", help=f"kind of file {GIVEN}"
        )
        part.add_argument("--json", action="store_true", help="print JSON instead of text")
        part.add_argument("--quiet", action="store_true", help="print nothing but errors")
        if kind == "stiffness":
            part.add_argument(
                "--torque", type=float, nargs="+", default=[67.0], help="largest torques [N m] (default: 67)"
            )
            part.add_argument(
                "--torque-rate",
                type=float,
                nargs="+",
                default=[2.0],
                help="how fast the torque changes [N m/s] (default: 2)",
            )
            part.add_argument("--loops", type=whole("--loops", 1, 100), default=2, help=f"whole loops {GIVEN}")
            part.add_argument(
                "--hysteresis", type=float, default=2.0, help=f"torque of the slip elements [N m] {GIVEN}"
            )
        elif kind == "kinematic-error":
            part.add_argument("--speed-rpm", type=float, default=15.0, help=f"motor speed [r/min] {GIVEN}")
            part.add_argument(
                "--revolutions",
                type=whole("--revolutions", 1, 10**6),
                default=121,
                help=f"revolutions of the motor {GIVEN}",
            )
        elif kind != "startstop":
            part.add_argument(
                "--coulomb",
                type=float,
                help=f"Coulomb torque [N m] (default: the file's, else {T_C}); a third more at rest",
            )


def run(options: argparse.Namespace) -> int:
    """Run the command and return 0."""
    from hdfast.report import bench_page

    prepare_own(options.out, (TRUTH,))
    settings = load(options.file)
    sensors = _sensors(options, settings)
    recordings, truth = _record(options, settings, sensors)
    drive = settings.nominal()
    path = folder.write(options.out, options.kind, recordings, truth, drive, sensors, options.seed, options.format)
    page = bench_page.write(options.kind, recordings, truth, path.parent, settings.text)
    absent = _left_out(options.kind, settings.model)
    if options.json:
        print(json_text({"kind": options.kind, "campaign": str(path), "truth": truth, "left_out": absent}))
    elif not options.quiet:
        lines = [f"{item.name}: {len(item['t'])} samples, {', '.join(item.columns)}" for item in recordings]
        lines += [f"in the file, not in this test: {', '.join(absent)}"] if absent else []
        print("\n".join([*lines, "", str(page), str(path), str(path.parent / TRUTH)]))
    return 0


def _left_out(kind: str, model: Model) -> list[str]:
    """Terms of the file that the test does not simulate: the loop knows the spring, rigid tests dry friction."""
    known = KNOWN.get(kind, model.terms)
    return [term for term in model.terms if term not in known]


def _sensors(options: argparse.Namespace, settings: Config) -> SensorStage:
    """The bench's own sensors, changed by what the file states, then by what the command line says."""
    if options.delay is not None:
        checks.number("--delay", options.delay, 0.0, EFFECTS["sensor_delay"].parameter("tau_y").allowed[1], "s")
    asked: dict[str, dict[str, float | None]] = {
        "motor_angle": {"resolution": _step(options.motor_bits)},
        "load_angle": {
            "resolution": _step(options.load_bits),
            "noise": options.angle_noise,
            "delay_s": options.delay,
        },
        "load_torque": {"noise": options.torque_noise},
        "output_torque": {"noise": options.torque_noise},
    }
    given = {(KEYS[key][0], channel) for channel, keys in asked.items() for key, v in keys.items() if v is not None}
    declared = [one for one in settings.effects if (one.effect, one.channel) not in given]
    channels = {}
    for name, facts in SENSORS.items():
        stated = [asdict(settings.sensors.get(name, facts)), asked.get(name, {})]
        channels[name] = replace(facts, **{k: v for keys in stated for k, v in keys.items() if v is not None})
    return rig(options.rate, effects=declared, **channels)


def _step(bits: int | None) -> float | None:
    return None if bits is None else encoder(bits).resolution


def _record(
    options: argparse.Namespace, settings: Config, sensors: SensorStage
) -> tuple[list[Recording], dict[str, Any]]:
    shared: dict[str, Any] = {"sensors": sensors, "seed": options.seed}
    drive, model = settings.drive, settings.model
    nominal = settings.nominal()
    if options.kind == "stiffness":
        return _loops(options, settings, sensors)
    if options.kind == "kinematic-error":
        runs = bench.kinematic_error(
            drive, model=model, speed_rpm=options.speed_rpm, revolutions=options.revolutions, **shared
        )
        return runs, {name: value for name, value in nominal.items() if name.startswith("te_")}
    if options.kind == "startstop":
        return [bench.startstop(drive, model=model, scenario=settings.scenario, **shared)], nominal
    viscous = nominal["B_m"] + nominal["B_ml"] + nominal["B_l"] / nominal["ratio"] ** 2
    inertia = nominal["J_m"] + nominal["J_l"] / nominal["ratio"] ** 2
    stated = nominal[settings.table.canonical(f"{DRY}_T_c")] if DRY in model.terms else T_C
    coulomb = stated if options.coulomb is None else options.coulomb
    law = bench.FrictionLaw(T_c=coulomb, T_s=AT_REST * coulomb, B=viscous)
    truth = {**asdict(law), "inertia": inertia}
    if options.kind == "friction":
        return bench.friction(law, ratio=nominal["ratio"], **shared), truth
    if options.kind == "starting-torque":
        made = bench.starting_torque(law, inertia=inertia, **shared)
        return made.recordings, made.truth
    return bench.coastdown(law, inertia=inertia, **shared), truth


def _differ(option: str, values: list[float]) -> None:
    """Refuse values whose recordings would have one name."""
    names = [f"{value:g}" for value in values]
    twice = [name for name in names if names.count(name) > 1]
    if twice:
        raise InputError(f"{option} = {twice[0]} is given more than once (allowed: once; --loops makes more loops)")


def _loops(
    options: argparse.Namespace, settings: Config, sensors: SensorStage
) -> tuple[list[Recording], dict[str, Any]]:
    """A recording for every torque at every rate; the truth is that of the largest torque."""
    _differ("--torque", options.torque)
    _differ("--torque-rate", options.torque_rate)
    found = {
        f"loop {torque:g} {rate:g}": bench.stiffness(
            settings.drive,
            model=settings.model,
            torque=torque,
            rate=rate,
            loops=options.loops,
            loop=bench.SlipLoop(torque=options.hysteresis),
            sensors=sensors,
            seed=[options.seed, index],
        )
        for index, (rate, torque) in enumerate(product(options.torque_rate, sorted(options.torque, reverse=True)))
    }
    recordings = [replace(made.recording, name=name) for name, made in found.items()]
    return recordings, next(iter(found.values())).truth
