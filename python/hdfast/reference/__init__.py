"""The same equations and methods once more, in plain Python.

Lists and `math`, no NumPy, no compiled code: slow, and short enough to be read against the formulas. `sweep` and
`simulate` take the arguments of `hdfast.sweep` and serve as its referee in the tests.

problem.py     one row in plain numbers          stepper.py    one Runge-Kutta step and its dense output
inputs.py      torque, reference, motion, load   integrate.py  the adaptive loop
drive.py       equations of motion               search.py     extrema, crossings, integrals inside steps
methods.py     tables of the four methods        metrics.py, mode.py   metrics from their definitions
"""

from .integrate import Trajectory, advance
from .metrics import Metrics
from .problem import Problem
from .sweep import ReferenceResult, simulate, solve_rows, sweep

__all__ = ["Metrics", "Problem", "ReferenceResult", "Trajectory", "advance", "simulate", "solve_rows", "sweep"]
