# /// script
# dependencies = ["scipy", "numpy"]
# ///
"""SIMD lanes written by hand in C++ (`lanes.cpp`)."""

import native

NAME = "C++ SIMD lanes, hand-written"
VARIANTS = ("DOP853", "Dormand-Prince 5(4)")
THREADS = True


def build(variant):
    return native.solver(native.library("lanes.cpp"), 8 if variant == "DOP853" else 5)
