"""The command `hdfast`.

Exit code 0: done; 1: done, but the answer is no (a specification not met, rows of `tolerance` or the drive of
`simulate` failed, a mark of `proof` missed, recordings rejected by `diagnose`); 2: wrong input; 130: interrupted.
"""

from __future__ import annotations

import argparse
import re
import shutil
import sys
from collections.abc import Sequence
from dataclasses import asdict
from importlib.metadata import version
from typing import Any, NoReturn

from hdfast import catalogue, checks, config, files
from hdfast.bench import command as bench
from hdfast.calibration import command as calibrate
from hdfast.catalogue import build_info
from hdfast.comparison import command as compare
from hdfast.config import Config
from hdfast.diagnosis import command as diagnose
from hdfast.errors import InputError, Interrupted, MissingPackageError, nearest
from hdfast.identify import command as identify
from hdfast.model import BASES, SPRINGS, Model
from hdfast.notes import notes_on_drive, notes_on_rows
from hdfast.params import params
from hdfast.printing import json_text, text_table
from hdfast.proof import command as proof
from hdfast.simulate import simulate
from hdfast.studies import command as study
from hdfast.terms import Term, terms
from hdfast.threads import MAX_THREADS, resolve_threads
from hdfast.tolerance import command as tolerance
from hdfast.tolerance.limits import judge
from hdfast.tolerance.sample import MAX_ROWS
from hdfast.tolerance.simulation import simulate_rows

DONE, NOT_MET, WRONG_INPUT, INTERRUPTED = 0, 1, 2, 130
SIMULATE = "Simulate the nominal drive of a TOML file with its full trajectory; exit code 1 when it does not finish."
WELCOME = """hdfast {version}: batch simulation of the torsional vibration of harmonic drives.

Three commands to try first:
  hdfast params                                              what describes a drive
  hdfast sweep examples/shf-25-120.toml --out out/demo       10,000 drives of one type, start to stop
  hdfast diagnose examples/concealed-friction/campaign.toml --out out/diagnosis   physics a model lacks

`hdfast COMMAND --help` explains each command with an example."""


class _Parser(argparse.ArgumentParser):
    """Argument parser whose complaints are one line and end with exit code 2."""

    # argparse leaves what a command does not know to the outermost parser, which does not know the command's options
    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        found, unknown = super().parse_known_args(args, namespace)
        if unknown:
            option = next((text.split("=")[0] for text in unknown if text.startswith("-")), None)
            if option is None:
                self.error(f"unexpected {unknown[0]!r}")
            alike = [known for known in self._option_string_actions if known[:3] == option[:3]]
            self.error(f"unknown option {option}{nearest(option, alike)}")
        return found, unknown

    def error(self, message: str) -> NoReturn:
        wrong = re.search(r"invalid choice: '(.+?)' \(choose from (.+)\)", message)
        if wrong:
            message += nearest(wrong[1], re.findall(r"[\w-]+", wrong[2]))
        print(f"{self.prog}: {message} (see {self.prog} --help)", file=sys.stderr)
        raise SystemExit(WRONG_INPUT)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code."""
    options = _parser().parse_args(arguments)
    if options.command is None:
        print(WELCOME.format(version=version("hdfast")))
        return DONE
    try:
        code: int = options.run(options)
    except (InputError, MissingPackageError) as error:
        print(f"hdfast: {error}", file=sys.stderr)
        return WRONG_INPUT
    except KeyboardInterrupt as stop:
        print(f"hdfast: {str(stop) or 'interrupted'}", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:
        sys.stderr.close()
        return DONE
    return code


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="hdfast", description="Batch simulation of the torsional vibration of harmonic drives.", allow_abbrev=False
    )
    parser.add_argument("--version", action="version", version=f"hdfast {version('hdfast')}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", parser_class=_Parser)

    def add(name: str, run: Any, text: str, example: str) -> argparse.ArgumentParser:
        command = commands.add_parser(
            name,
            help=text,
            description=text,
            epilog=f"example:\n  {example}",
            formatter_class=argparse.RawDescriptionHelpFormatter,
            allow_abbrev=False,
        )
        command.set_defaults(run=run)
        command.add_argument("--json", action="store_true", help="print JSON instead of text")
        command.add_argument("--quiet", action="store_true", help="print nothing but errors")
        return command

    example = "hdfast sweep examples/shf-25-120.toml --out out/demo --rows 1000 --seed 7"
    command = add("sweep", _sweep, "Simulate many drives drawn from the tolerances of a TOML file.", example)
    command.add_argument("file", metavar="FILE.toml", help="drive, tolerances, scenario and specification")
    command.add_argument("--out", metavar="DIR", help="folder for the page, the table, the JSON and the input")
    command.add_argument("--rows", type=_whole("--rows", 1, MAX_ROWS), help="number of drives instead of the file's")
    command.add_argument("--seed", type=_whole("--seed", 0, checks.MAX_SEED), help="seed instead of the file's")
    threads = "number of threads instead of the file's (default: all cores)"
    command.add_argument("--threads", type=_whole("--threads", 1, MAX_THREADS), help=threads)
    command.add_argument("--progress", action="store_true", help="show progress even when stderr is not a terminal")

    example = "hdfast simulate examples/shf-25-120.toml --out out/one"
    command = add("simulate", _simulate, SIMULATE, example)
    command.add_argument("file", metavar="FILE.toml", help="drive and scenario")
    command.add_argument("--out", metavar="DIR", help="folder for the page, the table, the JSON and the input")

    command = add(tolerance.NAME, tolerance.run, tolerance.TEXT, tolerance.EXAMPLE)
    tolerance.arguments(command, _whole)

    for room in (compare, calibrate, diagnose, proof, identify, study, bench):
        room.arguments(add(room.NAME, room.run, room.TEXT, room.EXAMPLE), _whole)

    command = add("params", _params, "List the parameters of a drive.", "hdfast params --spring piecewise")
    command.add_argument("--base", choices=BASES, default=BASES[0], help=f"base model (default: {BASES[0]})")
    command.add_argument("--spring", choices=SPRINGS, default=SPRINGS[0], help=f"spring law (default: {SPRINGS[0]})")
    command.add_argument("--terms", nargs="*", default=[], metavar="ID", help="terms beyond the nominal model")

    example = "hdfast terms coulomb_friction backlash"
    command = add("terms", _terms, "List the physics beyond the nominal model, or some of it in full.", example)
    command.add_argument("ids", nargs="*", metavar="ID", help="terms whose equation, source and parameters are shown")

    add("info", _info, "Show version, build, methods, metrics, signals and row statuses.", "hdfast info --json")
    return parser


def _whole(argument: str, low: int, high: int) -> Any:
    def convert(text: str) -> int:
        try:
            grouped = re.fullmatch(r"\d{1,3}(,\d{3})+", text)
            return checks.whole(argument, int(text.replace(",", "") if grouped else text), low, high)
        except InputError as error:
            raise argparse.ArgumentTypeError(str(error)) from None
        except ValueError:
            raise argparse.ArgumentTypeError(f"{text!r} is not a whole number from {low} to {high}") from None

    return convert


def _sweep(options: argparse.Namespace) -> int:
    from hdfast.report import folder, tables

    settings = config.load(options.file)
    if not options.quiet:
        sys.stderr.writelines(f"{note}\n" for note in notes_on_rows(settings))
    out = files.prepare_inputs(options.out, settings.inputs) if options.out else None
    seed = settings.run.seed if options.seed is None else options.seed
    try:
        result = simulate_rows(
            settings,
            rows=options.rows,
            seed=seed,
            threads=options.threads,
            progress=options.progress or (sys.stderr.isatty() and not options.quiet),
        )
    except Interrupted as stop:
        if out is not None:
            folder.write_sweep(out, settings, stop.result, [], seed, None)
            print(f"hdfast: finished rows are in {out / folder.ROWS}", file=sys.stderr)
        raise
    verdicts = judge(settings.specs, result, settings.plan())
    if out is not None:
        numbers = folder.write_sweep(out, settings, result, verdicts, seed, _nominal(settings))
    else:
        numbers = folder.summary(settings, result, verdicts, seed)
    if options.json:
        print(json_text(numbers))
    elif not options.quiet:
        print(_headline(settings, result, seed))
        print(text_table(tables.METRIC_HEADER, tables.metric_rows(result), right=range(2, len(tables.METRIC_HEADER))))
        if verdicts:
            print()
            print(text_table(tables.SPEC_HEADER, tables.spec_rows(verdicts, result.units), right=(2, 3, 4, 5, 6)))
        if out is not None:
            print(f"\n{out / files.PAGE}\n{out / folder.ROWS}\n{out / files.SUMMARY}")
    return DONE if all(verdict.met for verdict in verdicts) else NOT_MET


def _headline(settings: Config, result: Any, seed: int) -> str:
    counts = ", ".join(f"{name} {count:,}" for name, count in result.status_counts().items())
    lines = [
        f"{settings.title}",
        f"{len(result):,} rows ({counts}), seed {seed}, {result.seconds:.2f} s on {result.threads} "
        f"thread{'s' if result.threads > 1 else ''} ({result.simd}), "
        f"{result.rows_per_second:,.0f} rows/s",
    ]
    lines.extend(result.message(row) for row in (~result.finished).nonzero()[0][:3].tolist())
    return "\n".join(lines) + "\n"


def _nominal(settings: Config) -> Any:
    run = settings.run
    return simulate(
        settings.drive,
        model=settings.model,
        scenario=settings.scenario,
        method=run.method,
        rtol=run.rtol,
        atol=run.atol,
        max_steps=run.max_steps,
        sensors=settings.sensor_stage,
    )


def _simulate(options: argparse.Namespace) -> int:
    from hdfast.report import folder, tables

    settings = config.load(options.file)
    if not options.quiet:
        sys.stderr.writelines(f"{note}\n" for note in notes_on_drive(settings))
    out = files.prepare_inputs(options.out, settings.inputs) if options.out else None
    run = _nominal(settings)
    numbers = folder.write_simulate(out, settings, run) if out else folder.simulate_summary(settings, run)
    if options.json:
        print(json_text(numbers))
    elif not options.quiet:
        rows = [[name, tables.number(value), run.units[name]] for name, value in run.metrics.items()]
        print(f"{settings.title}\n{run.message}\n\n{text_table(['metric', 'value', 'unit'], rows, right=(1,))}")
        if out is not None:
            recording = [] if run.recorded is None else [folder.RECORDING]
            print("", *(out / name for name in (files.PAGE, folder.TRAJECTORY, *recording, files.SUMMARY)), sep="\n")
    return DONE if run.status == catalogue.FINISHED else NOT_MET


def _params(options: argparse.Namespace) -> int:
    table = params(Model(base=options.base, spring=options.spring, terms=options.terms))
    if options.json:
        print(json_text([asdict(row) for row in table]))
    elif not options.quiet:
        print(table)
    return DONE


def _terms(options: argparse.Namespace) -> int:
    chosen = [terms()[name] for name in options.ids] or list(terms())
    if options.json:
        print(json_text([asdict(row) for row in chosen]))
    elif options.ids and not options.quiet:
        print("\n\n".join(map(_in_full, chosen)))
    elif not options.quiet:
        width = shutil.get_terminal_size().columns if sys.stdout.isatty() else None
        table = text_table(["id", "place", "what it is"], [[row.id, row.place, row.description] for row in chosen])
        print("\n".join(line[:width] for line in table.splitlines()))
    return DONE


def _in_full(term: Term) -> str:
    header = ["parameter", "symbol", "unit", "default", "plausible", "meaning"]
    rows = [
        [part.name, part.symbol, part.unit, f"{part.default:.4g}", f"{part.low:.4g} .. {part.high:.4g}", part.meaning]
        for part in term.parameters
    ]
    facts = f"  equation  {term.equation}\n  source    {term.source}"
    return f"{term.id} ({term.place}): {term.description}\n{facts}\n\n{text_table(header, rows, right=(3,))}"


def _info(options: argparse.Namespace) -> int:
    quantities = {"metrics": catalogue.metrics(), "signals": catalogue.signals()}
    if options.json:
        numbers: dict[str, Any] = {
            "build": build_info(),
            "threads": resolve_threads(),
            "methods": list(catalogue.methods().values()),
        }
        numbers |= {kind: [asdict(item) for item in found.values()] for kind, found in quantities.items()}
        numbers["statuses"] = [asdict(status) for status in catalogue.statuses().values()]
        print(json_text(numbers))
        return DONE
    if options.quiet:
        return DONE
    print(text_table(["build", ""], [[key, str(value)] for key, value in build_info().items()]))
    print(f"threads of a sweep: {resolve_threads()}\n")
    methods = [[str(value) for value in method.values()] for method in catalogue.methods().values()]
    print(text_table(["method", *list(next(iter(catalogue.methods().values())))[1:]], methods), end="\n\n")
    for kind, found in quantities.items():
        print(text_table([kind, "unit", "meaning"], [[q.name, q.unit, q.meaning] for q in found.values()]), end="\n\n")
    print(text_table(["status", "what to do"], [[s.name, s.remedy] for s in catalogue.statuses().values()]))
    return DONE


if __name__ == "__main__":
    raise SystemExit(main())
