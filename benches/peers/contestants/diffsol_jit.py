# /// script
# dependencies = ["pydiffsol", "numpy"]
# ///
"""diffsol through pydiffsol: equations in DiffSL; a segment starts from states given as parameters."""

import equations
import numpy as np
import problem

NAME = "diffsol (pydiffsol)"
VARIANTS = ("tsit45", "bdf")
THREADS = False
STIFF = "bdf"
NAMES = ("jm", "jl", "bm", "bl", "bml", "bsp", "ka", "kc", "ke", "scale", "first", "rate")
STATES = ("theta", "omega", "te", "load", "z", "mean", "square")


def listing(full):
    """The equations in DiffSL, states divided by their sizes so that one absolute tolerance fits all."""
    states = STATES if full else STATES[:5]
    size = dict(zip(STATES, equations.FLOORS.tolist(), strict=True))
    angle = f"({size['theta']!r} * theta)"
    value, slope = [], []
    for n, (a, b) in enumerate(zip(equations.COSINES, equations.SINES, strict=True), start=1):
        value.append(f"{a:.17e} * cos({n}.0 * {angle}) + {b:.17e} * sin({n}.0 * {angle})")
        slope.append(f"{n * b:.17e} * cos({n}.0 * {angle}) - {n * a:.17e} * sin({n}.0 * {angle})")
    value, slope = (" + ".join(f"({term})" for term in terms) for terms in (value, slope))
    given = ", ".join(f"{name} = 1.0" for name in (*NAMES, *(f"{state}zero" for state in states)))
    real = {name: f"({size[name]!r} * {name})" for name in states}
    rates = {
        "theta": "om",
        "omega": f"({problem.K_P} * off + {problem.K_I} * {real['z']} - bm * om - slip - upsilon * gear) / jm",
        "te": f"om / {equations.RATIO} - ol",
        "load": "(gear - bl * ol + slip) / jl",
        "z": "off",
        "mean": real["te"],
        "square": f"{real['te']} * {real['te']}",
    }
    return f"""
in_i {{ {given} }}
u_i {{ {", ".join(f"{state} = {state}zero" for state in states)} }}
om {{ {real["omega"]} }}
ol {{ {real["load"]} }}
windup {{ {real["te"]} - scale * ({value}) }}
upsilon {{ 1.0 / {equations.RATIO} - scale * ({slope}) }}
gear {{ windup * (ka + windup * windup * (kc + windup * windup * ke)) + bsp * (upsilon * om - ol) }}
off {{ first + rate * t - om }}
slip {{ bml * (om - ol) }}
F_i {{ {", ".join(f"({rates[state]}) / {size[state]!r}" for state in states)} }}
"""


def build(variant):
    import pydiffsol

    odes = {}
    for full in (True, False):
        ode = pydiffsol.Ode(listing(full), matrix_type=pydiffsol.nalgebra_dense)
        ode.ode_solver = getattr(pydiffsol, variant)
        odes[full] = ode

    def solve(parameters, rtol, full):
        ode = odes[full]
        ode.rtol = ode.atol = rtol

        def integrate(t0, t1, y, p):
            scales = equations.FLOORS[: len(y)]
            segment = equations.STOPS.index(t1)
            rate = p[10] * (0, 0, 0, -2, 0)[segment] if segment else 2 * p[10]
            first = p[10] * (0, 1, 1, 1, 0)[segment]
            ode.t0 = 0.0
            answer = ode.solve(np.concatenate([p[:10], [first, rate], y / scales]), t1 - t0)
            path = np.asarray(answer.ys) * scales[:, None]
            return path[:, -1], path

        return equations.row_by_row(integrate, parameters, full)

    return solve
