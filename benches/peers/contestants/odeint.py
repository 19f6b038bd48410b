# /// script
# dependencies = ["libboost-headers", "scipy", "numpy"]
# ///
"""Boost.odeint in C++ (`odeint.cpp`)."""

import sysconfig
from pathlib import Path

import native

NAME = "Boost.odeint, C++"
VARIANTS = ("Dormand-Prince 5(4)", "Fehlberg 7(8)")
THREADS = False


def build(variant):
    headers = next(Path(sysconfig.get_paths()["purelib"]).rglob("boost/numeric/odeint.hpp")).parents[2]
    return native.solver(native.library("odeint.cpp", f"-I{headers}"), 8 if variant == "Fehlberg 7(8)" else 5)
