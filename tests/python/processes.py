"""Processes that a test starts."""

import signal
import subprocess
from typing import Any


def _heed_interrupts() -> None:
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def interruptible(command: list[str], **options: Any) -> subprocess.Popen[Any]:
    """A process that heeds SIGINT, which children of a background job otherwise ignore."""
    return subprocess.Popen(command, preexec_fn=_heed_interrupts, **options)  # noqa: PLW1509 - resets a signal, no more
