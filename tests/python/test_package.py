"""What `import hdfast` offers, whether it is loaded at once or when it is asked for."""

from __future__ import annotations

from importlib import import_module

import hdfast
import pytest


@pytest.mark.parametrize("name", hdfast.__all__)
def test_exact_every_public_name_is_reached(name):
    assert getattr(hdfast, name).__name__ == name
    assert name in dir(hdfast)


@pytest.mark.parametrize("name", hdfast.MODULES)
def test_exact_every_room_is_reached(name):
    assert getattr(hdfast, name) is import_module(f"hdfast.{name}")
    assert name in dir(hdfast)


def test_exact_results_are_of_the_public_classes():
    from hdfast.calibration.calibrate import Calibration
    from hdfast.comparison.compare import Comparison
    from hdfast.diagnosis.diagnose import Diagnosis

    assert (hdfast.Calibration, hdfast.Comparison, hdfast.Diagnosis) == (Calibration, Comparison, Diagnosis)
    brief = hdfast.Scenario.start_stop(t_end=0.1, t_off=0.05)
    assert isinstance(hdfast.sweep({}, scenario=brief), hdfast.SweepResult)


def test_exact_an_unknown_name_is_told():
    with pytest.raises(AttributeError, match="module 'hdfast' has no attribute 'swep'"):
        _ = hdfast.swep
