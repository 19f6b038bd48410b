"""Parts of a diagnosis side by side: the order, the share of the threads, and the end of all when one ends."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from concurrent.futures import CancelledError
from dataclasses import replace
from pathlib import Path
from threading import Barrier

import pytest
import small_campaign
from hdfast.diagnosis.replay import Replay
from hdfast.diagnosis.session import nominal, set_up_usable
from hdfast.diagnosis.together import side_by_side
from hdfast.recordings import load_campaign
from processes import interruptible

AT_A_TERMINAL = """
import sys
from hdfast.cli import main
sys.stderr.isatty = lambda: True
sys.exit(main(sys.argv[1:]))
"""
EXAMPLE = Path(__file__).parents[2] / "examples" / "concealed-friction" / "campaign.toml"


@pytest.fixture(scope="module")
def replay(tmp_path_factory: pytest.TempPathFactory) -> Replay:
    return set_up_usable(load_campaign(small_campaign.write(tmp_path_factory.mktemp("small"))), None).replay


@pytest.mark.parametrize(("threads", "parts", "share"), [(1, 3, 1), (2, 3, 1), (8, 3, 2), (4, 1, 4), (4, 0, None)])
def test_exact_parts_keep_their_order_and_share_the_threads(
    replay: Replay, threads: int, parts: int, share: int | None
) -> None:
    many = replace(replay, plant=replace(replay.plant, threads=threads))

    def work(own: Replay, part: int) -> tuple[int, int | None]:
        time.sleep(0.02 * (parts - part))
        return part, own.plant.threads

    assert list(side_by_side(many, work, range(parts))) == [(part, share) for part in range(parts)]


def test_exact_parts_share_the_noises_of_the_angle(replay: Replay) -> None:
    units = replay.shaken[0].plant.units
    for one in side_by_side(replay, lambda own, _: own.shaken[0].plant.units, range(2)):
        assert all(own is shared for own, shared in zip(one, units, strict=True))


def test_exact_when_one_fails_the_others_end(replay: Replay) -> None:
    """All but the first simulate on and on until they are told to end."""
    two = replace(replay, plant=replace(replay.plant, threads=2))
    structure = nominal(set_up_usable(load_campaign(EXAMPLE), None))
    together, begun, ended = Barrier(2), [], []

    def work(own: Replay, part: int) -> None:
        begun.append(part)
        if part < 2:
            together.wait(timeout=60.0)
        if part == 0:
            raise ValueError("no")
        try:
            while True:
                own.mismatch(structure, structure.start[None])
        except CancelledError:
            ended.append(part)
            raise

    with pytest.raises(ValueError, match="no"):
        list(side_by_side(two, work, range(50)))
    assert sorted(begun) == [0, *sorted(ended)]
    assert len(begun) < 50


def test_exact_an_interrupted_diagnosis_ends_at_once_and_writes_nothing(tmp_path: Path) -> None:
    """In the midst of simulations for the first screening, as the bar that a terminal shows tells."""
    command = [sys.executable, "-c", AT_A_TERMINAL, "diagnose", str(EXAMPLE), "--out", str(tmp_path / "out")]
    process = interruptible(command, stderr=subprocess.PIPE, stdout=subprocess.PIPE)
    shown = b""
    while b"calibrated the nominal model" not in shown and process.poll() is None:
        shown += os.read(process.stderr.fileno(), 4096)
    process.send_signal(signal.SIGINT)
    begin = time.monotonic()
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert errors.decode().strip().splitlines()[-1] == "hdfast: interrupted"
    assert time.monotonic() - begin < 5.0
    assert not (tmp_path / "out" / "verdict.json").exists()
