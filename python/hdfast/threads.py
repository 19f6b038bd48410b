"""How many threads a sweep uses: argument, HDFAST_NUM_THREADS, RAYON_NUM_THREADS, then what the system grants."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import Any

from hdfast import checks
from hdfast.errors import InputError

MAX_THREADS = 1024
VARIABLES = ("HDFAST_NUM_THREADS", "RAYON_NUM_THREADS")


def resolve_threads(threads: Any = None) -> int:
    """Number of threads to use.

    Args:
        threads: 1 to 1024, or None for the environment, then min(CPU affinity, cgroup quota).

    Raises:
        InputError: the argument or an environment variable is not a usable number.
    """
    if threads is not None:
        return checks.whole("threads", threads, 1, MAX_THREADS)
    for variable in VARIABLES:
        text = os.environ.get(variable, "").strip()
        if text in ("", "0"):
            continue
        if not text.isascii() or not text.isdigit() or not 1 <= int(text[:9]) <= MAX_THREADS:
            raise InputError(f"{variable} = {text!r} is not usable (allowed: a whole number from 1 to {MAX_THREADS})")
        return int(text)
    return available_threads()


def available_threads() -> int:
    """CPUs this process may run on, limited by the quota of its control group."""
    granted = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(1, min(granted, cgroup_quota(Path("/sys/fs/cgroup"), Path("/proc/self/cgroup"))))


def cgroup_quota(root: Path, membership: Path) -> int:
    """Whole CPUs granted by the tightest quota of the process's control groups (v2 and v1), rounded up."""
    limit = math.inf
    try:
        lines = membership.read_text().splitlines()
    except OSError:
        lines = []
    for line in ["0::/", *lines]:
        _, controllers, path = (*line.split(":", 2), "", "")[:3]
        if controllers == "":
            folder = root / path.lstrip("/")
            for level in [folder, *folder.parents]:
                limit = min(limit, _quota_v2(level / "cpu.max"))
                if level == root:
                    break
        elif "cpu" in controllers.split(","):
            for folder in (root / controllers / path.lstrip("/"), root / "cpu" / path.lstrip("/"), root / "cpu"):
                limit = min(limit, _quota_v1(folder))
    return MAX_THREADS if math.isinf(limit) else max(1, math.ceil(limit))


def _quota_v2(file: Path) -> float:
    try:
        quota, period = file.read_text().split()[:2]
        return math.inf if quota == "max" else int(quota) / int(period)
    except (OSError, ValueError, ZeroDivisionError):
        return math.inf


def _quota_v1(folder: Path) -> float:
    try:
        quota = int((folder / "cpu.cfs_quota_us").read_text())
        period = int((folder / "cpu.cfs_period_us").read_text())
        return quota / period if quota > 0 else math.inf
    except (OSError, ValueError, ZeroDivisionError):
        return math.inf
