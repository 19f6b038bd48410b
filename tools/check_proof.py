"""Hold a small run of the blind benchmark against what it must not fall below; run by `make proof-subset`.

Usage: python tools/check_proof.py out/proof-40/proof.json
"""

import json
import sys
from collections.abc import Callable
from pathlib import Path

#: Score, what it has to meet, and how that reads. Forty cases cannot show the marks themselves, only a fall.
FLOORS: dict[str, tuple[Callable[[float], bool], str]] = {
    "false alarms": (lambda value: value <= 0.1, "at most 10 %"),
    "selective accuracy": (lambda value: value >= 0.8, "at least 80 %"),
    "identification": (lambda value: value >= 0.3, "at least 30 %"),
    "outside the list: not named": (lambda value: value >= 0.6, "at least 60 %"),
}


FAULTS = ("crashed", "missing", "invalid", "late")


def main() -> int:
    """0 where every floor is met, else 1."""
    proof = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
    scores = {score["name"]: score["value"] for score in proof["scores"]}
    met = 0
    for name, (enough, words) in FLOORS.items():
        value = scores[name]
        good = value is not None and enough(value)
        met += good
        print(f"{'met ' if good else 'MISSED'}  {name}: {'none' if value is None else f'{value:.3f}'}, {words}")
    crashed = [one["case"] for one in proof["cases"] if one["answer"] in FAULTS]
    print(f"{'met ' if not crashed else 'MISSED'}  cases without a valid answer: {', '.join(crashed) or 'none'}")
    return 0 if met == len(FLOORS) and not crashed else 1


if __name__ == "__main__":
    sys.exit(main())
