"""What is missing or too old ends with one sentence that says what to install."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
GOOD = {
    "python3": "exit 0",
    "rustc": "echo 'rustc 1.91.0 (abc 2026-01-01)'",
    "cargo": '[ "$1" = --version ] || [ "$2" = --version ]',
    "cc": "exit 0",
}
CASES = [
    ({"python3": "exit 1"}, "4.3", "install it (for example the package 'python3.11'"),
    ({"rustc": None}, "4.3", "install rustup"),
    ({"rustc": "exit 1"}, "4.3", "install rustup"),
    ({"rustc": "echo 'rustc 1.88.0 (abc 2025-01-01)'"}, "4.3", "this is 1.88.0: run 'rustup update stable'"),
    ({"cargo": None}, "4.3", "cargo beside rustc"),
    ({"cargo": '[ "$1" = --version ]'}, "4.3", "rustup component add rustfmt clippy"),
    ({"cc": None}, "4.3", "install the package 'gcc'"),
    ({}, "3.81", "GNU make 3.82 or newer, this is 3.81"),
]


def check(tmp_path, changes, make):
    for name in ("bash", "env", "sort", "head", "cut"):
        (tmp_path / name).symlink_to(shutil.which(name))
    for name, body in {**GOOD, **changes}.items():
        if body is not None:
            (tmp_path / name).write_text(f"#!/bin/bash\n{body}\n")
            (tmp_path / name).chmod(0o755)
    command = [str(ROOT / "tools" / "check-tools"), make, "lint"]
    return subprocess.run(command, env={"PATH": str(tmp_path)}, capture_output=True, text=True, check=False)


def test_exact_everything_there(tmp_path):
    done = check(tmp_path, {}, "4.3")
    assert (done.returncode, done.stdout, done.stderr) == (0, "python3\n", "")


@pytest.mark.parametrize(("changes", "make", "text"), CASES)
def test_exact_one_sentence_says_what_to_install(changes, make, text, tmp_path):
    done = check(tmp_path, changes, make)
    assert done.returncode == 2
    assert text in done.stderr
    assert done.stderr.count("\n") == 1
    assert done.stdout == ""
