"""Every contestant's own environment under target/peers, from the dependencies written at the top of its file."""

import ast
import os
import re
import subprocess
import sys
import tomllib
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).parent
CONTESTANTS = HERE / "contestants"
OUT = HERE.parents[1] / "target" / "peers"
HEADER = re.compile(r"^# /// script\n((?:#.*\n)+?)# ///$", re.MULTILINE)


@dataclass(frozen=True)
class Contestant:
    """What a file in `contestants/` says about itself without being run."""

    file: str
    name: str
    variants: tuple[str, ...]
    threads: bool
    batch: int
    stiff: str
    dependencies: tuple[str, ...]

    @property
    def lines(self) -> int:
        """Lines of code a user has to write: the file and what it draws on, without blanks, comments and docstrings."""
        text = (CONTESTANTS / f"{self.file}.py").read_text(encoding="utf-8")
        shared = {"problem": HERE.parent, "equations": HERE, "native": CONTESTANTS, "numba_rows": HERE.parent}
        drawn = [
            folder / f"{name}.py" for name, folder in shared.items() if name == "problem" or f"import {name}\n" in text
        ]
        sources = [CONTESTANTS / name for name in re.findall(r'library\("(\w+\.cpp)"', text)]
        sources += [CONTESTANTS / "problem.hpp"] if sources else []
        return sum(map(code_lines, [CONTESTANTS / f"{self.file}.py", *drawn, *sources]))


def code_lines(path: Path) -> int:
    """Lines that are code."""
    text = re.sub(r'"""[\s\S]*?"""', "", path.read_text(encoding="utf-8"))
    lines = (line.strip() for line in text.splitlines())
    return sum(1 for line in lines if line and not line.startswith("//" if path.suffix != ".py" else "#"))


def contestants() -> list[Contestant]:
    """All of them, by what their files assign at the top."""
    return [found for path in sorted(CONTESTANTS.glob("*.py")) if (found := described(path))]


def described(path: Path) -> Contestant | None:
    """The contestant in a file, or None where the file is something else."""
    text = path.read_text(encoding="utf-8")
    assigned: dict[str, object] = {}
    for node in ast.parse(text).body:
        if isinstance(node, ast.Assign):
            names = [node.targets[0]] if isinstance(node.targets[0], ast.Name) else node.targets[0].elts
            values = [node.value] if isinstance(node.targets[0], ast.Name) else getattr(node.value, "elts", [])
            for target, value in zip(names, values, strict=False):
                if isinstance(value, ast.Constant):
                    assigned[target.id] = value.value
                elif isinstance(value, ast.Tuple) and target.id == "VARIANTS":
                    assigned["VARIANTS"] = tuple(
                        each.value if isinstance(each, ast.Constant) else assigned[each.id] for each in value.elts
                    )
    if "VARIANTS" not in assigned:
        return None
    header = HEADER.search(text)
    script = tomllib.loads(re.sub(r"^# ?", "", header[1], flags=re.MULTILINE)) if header else {}
    return Contestant(
        path.stem,
        str(assigned["NAME"]),
        assigned["VARIANTS"],
        bool(assigned["THREADS"]),
        int(assigned.get("BATCH", 1)),
        str(assigned.get("STIFF", "")),
        tuple(script.get("dependencies", ())),
    )


def interpreter(contestant: Contestant) -> Path | str:
    """The Python of the contestant's environment, made on first use; a sentence where it cannot be made."""
    if not contestant.dependencies:
        return Path(sys.executable)
    folder = OUT / contestant.file
    python, done = folder / "bin" / "python", folder / "dependencies"
    wanted = "\n".join(contestant.dependencies)
    if not (done.exists() and done.read_text(encoding="utf-8") == wanted):
        print(f"  installing {', '.join(contestant.dependencies)} ...", flush=True)
        subprocess.run([sys.executable, "-m", "venv", str(folder)], check=True)
        quiet = [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
        answer = subprocess.run([*quiet, *contestant.dependencies], capture_output=True, text=True, check=False)
        if answer.returncode != 0:
            return reason(answer.stderr)
        done.write_text(wanted, encoding="utf-8")
    return python


def reason(said: str) -> str:
    """What matters of an installer's complaint."""
    lines = [line.strip() for line in said.splitlines() if line.strip()]
    telling = [line for line in lines if re.search(r"error|not find|could be found", line, re.IGNORECASE)]
    return f"cannot be installed here: {(telling or lines or ['no reason given'])[-1][:160]}"


def version(contestant: Contestant, python: Path) -> str:
    """Version of the first dependency, or of the compiler."""
    if not contestant.dependencies:
        code = "import hdfast; print(hdfast.build_info()['version'])"
    else:
        package = contestant.dependencies[0]
        code = f"import importlib.metadata as m; print('{package}', m.version('{package}'))"
    if contestant.file == "lanes":
        return (
            subprocess.run(["g++", "-dumpfullversion"], capture_output=True, text=True, check=True).stdout.strip()
            + " g++"
        )
    return subprocess.run(
        [python, "-c", code], capture_output=True, text=True, check=True, env=os.environ
    ).stdout.strip()
