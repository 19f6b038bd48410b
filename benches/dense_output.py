"""How far samples inside the steps are off by relative tolerance, and those that fall on the ends of steps.

python benches/dense_output.py
"""

import numpy as np
import problem

ROWS = 64
TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-6, 1e-8)
INSIDE = np.linspace(0.0, 3.0, 3001)
#: Steps end where the set speed bends.
ENDS = np.array(problem.CORNERS[1:-1])


def windup(grid: np.ndarray, rtol: float) -> np.ndarray:
    """Samples of the windup, a row per drive."""
    options = {"method": "dop853", "rtol": rtol, "t_eval": grid, "signals": ["windup"]}
    return problem.sweep(problem.columns(ROWS), (), **options)["windup"]


def main() -> None:
    exact = {name: windup(grid, 1e-12) for name, grid in (("inside", INSIDE), ("ends", ENDS))}
    size = np.max(np.abs(exact["inside"]), axis=1, keepdims=True)
    print("rtol     inside the steps   at their ends   (worst windup error over the row's largest windup)")
    for rtol in TOLERANCES:
        inside, ends = (
            np.max(np.abs(windup(grid, rtol) - exact[name]) / size)
            for name, grid in (("inside", INSIDE), ("ends", ENDS))
        )
        print(f"{rtol:<8.0e} {inside:<18.1e} {ends:.1e}")


if __name__ == "__main__":
    main()
