"""The command `hdfast identify`."""

from __future__ import annotations

import argparse
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from hdfast import identify
from hdfast.config import load as load_config
from hdfast.errors import ConfigError, InputError
from hdfast.files import FIT, prepare_own
from hdfast.identify.fit import Fit, joined, plain
from hdfast.identify.tolerances import located
from hdfast.printing import json_text
from hdfast.recordings import gather, recorded
from hdfast.recordings.priors import POLYNOMIAL

NAME = "identify"
TEXT = "Identify a drive from recordings: stiffness, kinematic error, friction, starting torque, coast-down."
EXAMPLE = "hdfast identify stiffness out/bench-stiffness/campaign.toml --out out/stiffness"
KINDS = {
    "stiffness": "spring and hysteresis from torque-windup loops at the locked input",
    "kinematic-error": "Fourier series of the kinematic error from slow runs at constant speed",
    "friction": "Coulomb, Stribeck and viscous friction from a ladder of constant speeds",
    "starting-torque": "distribution of the starting torque from slow ramps out of rest",
    "coastdown": "friction over inertia from coasting to rest",
}
GAIN = ("J_l", "k1", "B_sp", "B_l")


def arguments(command: argparse.ArgumentParser, whole: Callable[[str, int, int], Any]) -> None:
    """Declare the arguments; `whole` makes a reader of whole numbers."""
    kinds = command.add_subparsers(dest="kind", metavar="KIND", required=True)
    for kind, text in KINDS.items():
        example = f"example:\n  hdfast identify {kind} out/bench-{kind}/campaign.toml --out out/{kind}"
        shape = argparse.RawDescriptionHelpFormatter
        part = kinds.add_parser(kind, help=text, description=text, epilog=example, formatter_class=shape)
        part.add_argument(
            "input",
            nargs="+",
            metavar="FILE",
            help="one campaign TOML, or recordings (CSV, TSV, Parquet, NPZ, MAT, HDF5, MDF, TDMS)",
        )
        part.add_argument(
            "--model", metavar="FILE.toml", help="drive that is taken as known, and into which the result goes"
        )
        part.add_argument("--out", metavar="DIR", help="folder for the page, the model file, the JSON and the points")
        if kind != "starting-torque":
            part.add_argument("--ratio", type=float, help="gear ratio instead of the file's")
        part.add_argument(
            "--column",
            action="append",
            default=[],
            metavar="NAME=COLUMN[*SCALE]",
            help="where a standard column stands in the file, and its factor to SI units; may be repeated",
        )
        part.add_argument("--json", action="store_true", help="print JSON instead of text")
        part.add_argument("--quiet", action="store_true", help="print nothing but errors")
        if kind == "stiffness":
            part.add_argument(
                "--law",
                choices=("odd", "full", "piecewise"),
                default="odd",
                help="law of the model file (default: odd)",
            )
            part.add_argument(
                "--corners",
                type=float,
                nargs=2,
                metavar=("T1", "T2"),
                help="torques at which K1, K2, K3 meet [N m] (default: 14 48)",
            )
            part.add_argument("--rated-torque", type=float, default=67.0, help="rated torque [N m] (default: 67)")
        elif kind == "kinematic-error":
            part.add_argument("--orders", help="orders, such as 1,2,4,240/121 (default: 1 to n by cross-validation)")
            part.add_argument("--most", type=whole("--most", 1, 60), default=20, help="largest n tried (default: 20)")
        elif kind == "coastdown":
            part.add_argument("--inertia", type=float, help="moving inertia at the motor [kg m^2]")
            part.add_argument("--cubic", action="store_true", help="fit a cubic term as well")


def run(options: argparse.Namespace) -> int:
    """Run the command; 0 when something was identified."""
    if options.out:
        prepare_own(options.out, (FIT,))
    fit = _identify(options)
    page = fit.report(options.out) if options.out else None
    if options.json:
        from hdfast.report.identify_page import summary

        print(json_text(summary(fit)))
    elif not options.quiet:
        print(fit)
        if page is not None:
            print(f"\n{page}\n{page.parent / 'model.toml'}\n{page.parent / FIT}")
    return 0


def _identify(options: argparse.Namespace) -> Fit:
    columns = _columns(options.column)
    recordings, base, source, notes = _inputs(options.input, columns)
    if options.model is not None:
        model = located(tomllib.loads(load_config(options.model).text), Path(options.model).parent)
        base = base | model | {"drive": joined(plain(base.get("drive", {})), plain(model.get("drive", {})))}
    elif source:  # without that section the drive of a campaign has no kinematic error, that of a sweep the default one
        base = {"kinematic_error": {"orders": []}} | base
    fit = _fit(options, recordings, {"base": base, "source": source})
    fit.notes.extend(notes)
    return fit


def _fit(options: argparse.Namespace, recordings: list[Any], shared: dict[str, Any]) -> Fit:
    drive = plain(shared["base"].get("drive", {}))
    if options.kind == "starting-torque":
        return identify.starting_torque(recordings, **shared)
    ratio = options.ratio if options.ratio is not None else drive.get("ratio")
    if options.kind == "stiffness":
        corners: dict[str, Any] = {"corners": tuple(options.corners)} if options.corners else {}
        return identify.stiffness(
            recordings, law=options.law, ratio=ratio, rated_torque=options.rated_torque, **corners, **shared
        )
    if options.kind == "coastdown":
        return identify.coastdown(recordings, inertia=options.inertia, ratio=ratio, cubic=options.cubic, **shared)
    if ratio is None:
        raise InputError("ratio is missing: give --ratio, or [drive] ratio in the campaign or the model file")
    if options.kind == "friction":
        return identify.friction(recordings, ratio=ratio, **shared)
    gain = {name: float(drive[name]) for name in GAIN} if set(GAIN) <= set(drive) else None
    orders = [part.strip() for part in options.orders.split(",")] if options.orders else None
    return identify.kinematic_error(recordings, ratio=ratio, orders=orders, most=options.most, gain=gain, **shared)


def _inputs(paths: list[str], columns: Mapping[str, Any]) -> tuple[list[Any], dict[str, Any], str, list[str]]:
    """Recordings, base and text of a campaign, or recordings alone; notes on what was left out."""
    if not any(path.endswith(".toml") for path in paths):
        return gather(paths, columns), {}, "", []
    if len(paths) != 1:
        raise InputError("give one campaign TOML or recordings, not both")
    if columns:
        raise InputError("--column has no meaning with a campaign, whose section [columns] says it")
    campaign = recorded(paths[0])
    chosen = [item for item in campaign.recordings if item.role == "fit"]
    notes = [f"{item.name}: held out, not used" for item in campaign.recordings if item.role != "fit"]
    if not chosen:
        chosen, notes = campaign.recordings, ["every recording is held out: all are used"]
    return chosen, located(_with_zeros(campaign.data), Path(paths[0]).parent), campaign.text, notes


def _with_zeros(campaign: Mapping[str, Any]) -> dict[str, Any]:
    """Sections of a campaign with the 0 of what it leaves out beside stated values; sweeps would take a default."""
    drive, error = campaign.get("drive", {}), campaign.get("kinematic_error", {})
    found = dict(campaign)
    if set(POLYNOMIAL) & set(drive):
        found["drive"] = dict.fromkeys(POLYNOMIAL, 0.0) | drive
    if error and not {"cos", "amplitude"} & set(error):
        orders = error.get("orders", [])
        found["kinematic_error"] = {"orders": orders, "cos": [0.0] * len(orders), "sin": [0.0] * len(orders)} | error
    return found


def _columns(entries: list[str]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for entry in entries:
        name, separator, rest = entry.partition("=")
        column, star, scale = rest.partition("*")
        if not separator or not column:
            raise InputError(f"--column {entry!r} is not NAME=COLUMN or NAME=COLUMN*SCALE")
        try:
            found[name] = {"name": column, "scale": float(scale) if star else 1.0}
        except ValueError:
            raise ConfigError(f"--column {entry!r}: {scale!r} is not a number") from None
    return found
