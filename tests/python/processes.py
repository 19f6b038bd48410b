"""Processes that a test starts."""

import signal


def interruptible() -> None:
    """Lets a child be interrupted even where the tests run in the background, which makes children ignore SIGINT."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
