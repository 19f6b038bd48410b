"""Run a tool on one case as a process of its own that is given nothing but the case."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import CancelledError, ThreadPoolExecutor, as_completed
from contextlib import suppress
from pathlib import Path

import hdfast
from hdfast import files
from hdfast.errors import InputError
from hdfast.proof.score import Answer, read_answer
from hdfast.proof.seal import SealError
from hdfast.threads import VARIABLES, resolve_threads

LIMIT = 120.0
POLL = 0.2
OUTCOME = "outcome.json"
LATE = "late"
CODE = (".py", ".so", ".pyd")
COMMAND = "import sys; from hdfast.cli import main; sys.exit(main())"
DIAGNOSE = (sys.executable, "-c", COMMAND, "diagnose", "{campaign}", "--out", "{out}", "--no-report", "--quiet")
REJECTED = 1


def startable(tool: Sequence[str]) -> tuple[str, ...]:
    """The command with the whole path of its program, as it is started in another folder.

    Raises:
        InputError: there is no such program.
    """
    program = shutil.which(tool[0])
    if program is None:
        raise InputError(f"tool = {tool[0]!r} cannot be started (allowed: a program on the PATH, or a path to one)")
    return (str(Path(program).absolute()), *tool[1:])


def answer_all(
    cases: Path, names: Sequence[str], answers: Path, workers: int, tool: Sequence[str], limit: float,
    step: Callable[[int, int], None],
) -> None:  # fmt: skip
    """Answer every case that has no outcome yet; when interrupted, tools under way are ended without one.

    Tools that run side by side share the threads: each with all of them, they would wait for each other.

    The limit is that of a case with the machine to itself: one that is late beside others is answered once more, alone,
    also where that is after an interruption.

    Args:
        cases: folder of cases.
        names: the cases to answer.
        answers: folder of answers; one subfolder per case, whatever the tool wrote and `outcome.json`.
        workers: tools running at the same time.
        tool: command with the places {campaign} and {out}.
        limit: wall time per case [s].
        step: told after every case how many of how many are done.
    """
    left = unanswered(names, answers)
    step(len(names) - len(left), len(names))
    stop = threading.Event()
    for side_by_side in sorted({workers, 1}, reverse=True):
        now = [name for name in left if side_by_side == 1 or not late_mark(answers / name).exists()]
        with ThreadPoolExecutor(side_by_side) as pool:
            try:
                told = [pool.submit(answer, cases / n, answers / n, tool, limit, stop, side_by_side) for n in now]
                for future in as_completed(told):
                    future.result()
                    step(len(names) - len(unanswered(names, answers)), len(names))
            except BaseException:
                stop.set()
                pool.shutdown(cancel_futures=True)
                raise
        left = unanswered(names, answers)


def unanswered(names: Sequence[str], answers: Path) -> list[str]:
    """The cases without an outcome."""
    return [name for name in names if not (answers / name / OUTCOME).exists()]


def has_begun(names: Sequence[str], answers: Path) -> bool:
    """Whether a case was answered, if only too late."""
    left = unanswered(names, answers)
    return len(left) < len(names) or any(late_mark(answers / name).exists() for name in left)


def late_mark(out: Path) -> Path:
    """The file beside an answer's folder that stands for an answer that was late beside others."""
    return out.with_name(f"{out.name}.{LATE}")


def same_tool(note: Path, tool: Sequence[str], limit: float, *, begun: bool) -> None:
    """Note who answers, or check that it is who has begun.

    Args:
        note: file beside the answers.
        tool: command with places.
        limit: wall time per case [s].
        begun: whether there are answers.

    Raises:
        SealError: they are of another build, command or limit.
    """
    own = {"command": [Path(tool[0]).name, *tool[1:]], "limit": limit, "build": fingerprint()}
    if not begun:
        files.write_json(note, own)
    elif not note.exists() or json.loads(note.read_text(encoding="utf-8")) != own:
        raise SealError(f"{note}: the answers there are of another build, command or time limit (give another --out)")


def fingerprint() -> str:
    """SHA-256 of the code of this package, in hexadecimal."""
    root = Path(hdfast.__file__).parent
    found = hashlib.sha256()
    for path in sorted(one for one in root.rglob("*") if one.suffix in CODE):
        found.update(path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes())
    return found.hexdigest()


def answer(
    case: Path, out: Path, tool: Sequence[str], limit: float, stop: threading.Event, side_by_side: int = 1,
) -> None:  # fmt: skip
    """Answer one case: copy it away, run the tool there, bring its folder back, and say how it ended.

    Of an answer that is late without having been alone only a mark is left, and the next one is told as given again.

    Raises:
        CancelledError: `stop` was set before the tool ended; nothing is left of the answer.
        InputError: the tool cannot be started.
    """
    shutil.rmtree(out, ignore_errors=True)
    mark = late_mark(out)
    with tempfile.TemporaryDirectory(prefix="hdfast-case-") as scratch:
        here = Path(scratch)
        shutil.copytree(case, here / "case")
        places = {"{campaign}": str(here / "case" / "campaign.toml"), "{out}": str(here / "out")}
        begin = time.monotonic()
        fault, detail = _run([_filled(part, places) for part in tool], here, limit, stop, side_by_side)
        seconds = time.monotonic() - begin
        if fault == LATE and side_by_side > 1:
            files.write_text(files.prepare(out.parent) / mark.name, "")
            return
        if not _brought(here / "out", files.prepare(out)):
            fault, detail = fault or "crashed", f"{detail}; its folder cannot be copied"
    ended = {"fault": fault, "detail": detail, "seconds": round(seconds, 3), "again": mark.exists()}
    files.write_json(out / OUTCOME, ended)
    mark.unlink(missing_ok=True)


def _brought(written: Path, out: Path) -> bool:
    """Whether what a tool wrote, if anything, could be copied."""
    try:
        if written.exists():
            shutil.copytree(written, out, dirs_exist_ok=True)
    except OSError:
        return False
    return True


def _filled(part: str, places: Mapping[str, str]) -> str:
    for place, value in places.items():
        part = part.replace(place, value)
    return part


def _run(
    command: Sequence[str], cwd: Path, limit: float, stop: threading.Event, side_by_side: int
) -> tuple[str, str]:  # fmt: skip
    """Fault and detail of one run."""
    threads = {VARIABLES[0]: str(max(1, resolve_threads() // side_by_side))}
    try:
        process = subprocess.Popen(
            command, cwd=cwd, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
            start_new_session=True, env=os.environ | threads,
        )  # fmt: skip
    except OSError as error:
        raise InputError(f"tool = {command[0]!r} cannot be started: {error.strerror}") from None
    complaint = _complaint(process, limit, stop)
    if complaint is None:
        if stop.is_set():
            raise CancelledError
        return LATE, f"stopped after {limit:g} s"
    last = " ".join(complaint.decode(errors="replace").strip().splitlines()[-1:])[:200]
    ended = f"exit code {process.returncode}{': ' if last else ''}{last}"
    verdict = cwd / "out" / "verdict.json"
    if process.returncode == REJECTED:
        return ("" if _rejects(verdict) else "crashed"), ended
    if process.returncode:
        return "crashed", ended
    return ("" if verdict.exists() else "missing"), ended


def _rejects(verdict: Path) -> bool:
    """Whether a verdict says that the recordings cannot be used; a tool that fails may leave another one behind."""
    try:
        return bool(json.loads(verdict.read_text(encoding="utf-8"))["verdict"] == "data_rejected")
    except (OSError, ValueError, LookupError, TypeError, RecursionError):
        return False


def _complaint(process: subprocess.Popen[bytes], limit: float, stop: threading.Event) -> bytes | None:
    """What a tool wrote to stderr; None when limit or stop came first, which ends its whole process group."""
    end = time.monotonic() + limit
    while not stop.is_set() and (left := end - time.monotonic()) > 0.0:
        with suppress(subprocess.TimeoutExpired):
            return process.communicate(timeout=min(POLL, left))[1]
    os.killpg(process.pid, signal.SIGKILL)
    process.communicate()
    return None


def given_again(answers: Path) -> int:
    """How many answers were late beside others and were given again alone."""
    return sum(json.loads(one.read_text(encoding="utf-8")).get("again", False) for one in answers.glob(f"*/{OUTCOME}"))


def read_answers(cases: Path, answers: Path) -> dict[str, Answer]:
    """The answers to all cases that have an outcome."""
    out = {}
    for case in sorted(cases.iterdir()):
        outcome = answers / case.name / OUTCOME
        if outcome.exists():
            ended = json.loads(outcome.read_text(encoding="utf-8"))
            out[case.name] = read_answer(outcome.parent, ended["seconds"], ended["fault"], ended["detail"])
    return out
