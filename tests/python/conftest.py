from __future__ import annotations

import numpy as np
import pytest
from hypothesis import settings

settings.register_profile("same", derandomize=True, deadline=None)
settings.register_profile("new", print_blob=True, deadline=None)


def pytest_addoption(parser):
    parser.addoption(
        "--long",
        action="store_true",
        help="comparisons against references in full size, properties on new examples (minutes)",
    )


def pytest_configure(config):
    settings.load_profile("new" if config.getoption("--long") else "same")
    config.addinivalue_line("markers", "long: only with --long, or in another size with it")


def pytest_collection_modifyitems(config, items):
    """With --long, what takes it into account is marked as well: `-m long` leaves out what runs without it anyway."""
    for item in items:
        if config.getoption("--long"):
            if "long" in item.fixturenames:
                item.add_marker("long")
        elif "long" in item.keywords:
            item.add_marker(pytest.mark.skip(reason="needs --long"))


@pytest.fixture(scope="session")
def long(request):
    """True when the full-size comparisons were asked for."""
    return request.config.getoption("--long")


class Run:
    """Result of either backend as arrays."""

    def __init__(self, result, metrics, samples, finished):
        self.result = result
        self.metrics = {name: np.asarray(values, dtype=float) for name, values in metrics.items()}
        self.samples = {name: np.asarray(values, dtype=float) for name, values in samples.items()}
        self.final_state = np.asarray(result.final_state, dtype=float)
        self.finished = finished


class Engine:
    """`hdfast.sweep`."""

    name = "engine"
    slow = False

    def __call__(self, data, **options):
        import hdfast

        result = hdfast.sweep(data, **options)
        return Run(result, result.metrics, result.samples or {}, np.asarray(result.status) == 0)


class Reference:
    """`hdfast.reference.sweep`: few rows, the same answers."""

    name = "reference"
    slow = True

    def __call__(self, data, **options):
        import hdfast.reference

        result = hdfast.reference.sweep(data, **options)
        return Run(result, result.metrics, result.samples, np.array(result.status) == "finished")


@pytest.fixture(params=[Engine, pytest.param(Reference, marks=pytest.mark.long)], ids=lambda backend: backend.name)
def sweep(request, long):
    """The same call against the engine and against the reference; `sweep.slow` asks for few rows of the latter."""
    backend = request.param()
    backend.slow = backend.slow and not long
    return backend


def leave_figures_out(patch):
    """Pages have empty figures: drawing them takes most of their time."""
    patch.setattr("hdfast.report.plots.svg", lambda figure: "")


@pytest.fixture
def undrawn(monkeypatch):
    """See `leave_figures_out`."""
    leave_figures_out(monkeypatch)


@pytest.fixture
def engine():
    return Engine()


@pytest.fixture
def reference():
    return Reference()
