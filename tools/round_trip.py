"""Writes docs/round-trip.md: known drive, virtual bench, sensors, identification, over many seeds.

Usage: python tools/round_trip.py [SEEDS] [FOLDER]; 500 seeds and docs unless given. Half an hour at 500 seeds.
"""

from __future__ import annotations

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
HEAD = """# Round trips: what an identification gives back of a known drive

Written by `python tools/round_trip.py {seeds}`; the bounds are asserted by `pytest --long` with 100 seeds.

A virtual bench knows the drive, its recordings pass the sensors, the identification sees only those. Each cell states
the worst relative error over all seeds and the share of the stated 90 % intervals that hold the truth.
"""
SPRING = """
## Spring and loop, `hdfast identify stiffness`

Two loops of ±67 N m at 2 N m/s, 0.05 N m noise on the torque, 1 µrad on the load angle. Polynomial and three-slope
springs are recorded and identified with their own law.

| load encoder | rate | k1 | k3 | k5 | its loop's energy | K1 | K2 | K3 | its loop's energy |
|---|---|---|---|---|---|---|---|---|---|
"""
ORDERS = """
## Orders, `hdfast identify kinematic-error`

Fifteen orders from 90 to 1.03 µrad, both directions, 1 µrad noise on the load angle, {seeds} seeds. The smallest order
decides how long a run has to be. Worst amplitude: the largest relative error of any order. Coverage: share of the 90 %
intervals that hold the truth, the mean over the orders, and the least and most of any order.

| load encoder | rate | motor revolutions | speed | 15 orders found | worst amplitude | their coverage | least, most |
|---|---|---|---|---|---|---|---|
"""
COEFFICIENTS = (("polynomial", ("k1", "k3", "k5", "loop_energy")), ("piecewise", ("K1", "K2", "K3", "loop_energy")))


def main() -> int:
    """Run every round trip and write the page."""
    sys.path.insert(0, str(ROOT / "tests" / "python"))
    import round_trips

    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else 500
    few = max(seeds // 5, 1)
    target = Path(sys.argv[2]) if len(sys.argv) > 2 else ROOT / "docs"
    springs = [_spring_row(round_trips, bits, rate, seeds) for bits, rate in round_trips.SENSORS]
    orders = [_order_row(round_trips, bits, rate, few) for bits, rate in round_trips.RUNS]
    page = HEAD.format(seeds=seeds) + SPRING + "\n".join(springs) + "\n" + ORDERS.format(seeds=few) + "\n".join(orders)
    (target / "round-trip.md").write_text(page + "\n", encoding="utf-8")
    return 0


def _spring_row(round_trips, bits: int, rate: float, seeds: int) -> str:
    cells = [f"{bits} bit", f"{rate:g} Hz"]
    for spring, names in COEFFICIENTS:
        found = round_trips.springs(spring, bits, rate, seeds)
        cells += [f"{100.0 * found[name].worst:.2g} %, {found[name].coverage:.2f}" for name in names]
    return "| " + " | ".join(cells) + " |"


def _order_row(round_trips, bits: int, rate: float, seeds: int) -> str:
    found, counts = round_trips.orders(bits, rate, seeds)
    revolutions, speed = round_trips.RUNS[bits, rate]
    amplitudes = [found[f"te_{n}"] for n in range(1, 16)]
    coverage = [tally.coverage for tally in amplitudes]
    cells = [f"{bits} bit", f"{rate:g} Hz", f"{revolutions}", f"{speed:g} r/min"]
    cells += ["always" if counts == {(15, 15)} else "not always"]
    cells += [f"{100.0 * max(tally.worst for tally in amplitudes):.2g} %", f"{sum(coverage) / len(coverage):.3f}"]
    return "| " + " | ".join([*cells, f"{min(coverage):.2f}, {max(coverage):.2f}"]) + " |"


if __name__ == "__main__":
    raise SystemExit(main())
