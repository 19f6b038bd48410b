"""What an exception carries comes along when another process raises it."""

from __future__ import annotations

import pickle
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import hdfast
import pytest
from hdfast.errors import MissingPackageError
from hdfast.proof.generator.case import UnfitError
from hdfast.proof.seal import SealError
from hdfast.tolerance.policy import FailedRowsError
from hdfast.tolerance.progress import ProgressError

RAISED = [
    hdfast.InputError("text"),
    hdfast.ParameterError("text"),
    hdfast.RowError("text", 3, "J_l"),
    hdfast.ConfigError("text", 4),
    MissingPackageError("text"),
    FailedRowsError("te_pp", [1, 2], 2, 10),
    ProgressError(ValueError("text")),
    SealError("text"),
    UnfitError("text"),
]


@pytest.mark.parametrize("raised", RAISED, ids=lambda raised: type(raised).__name__)
def test_exact_every_exception_survives_pickling(raised):
    found = pickle.loads(pickle.dumps(raised))
    assert (type(found), str(found)) == (type(raised), str(raised))
    assert repr(found.__dict__) == repr(raised.__dict__)


def test_exact_an_interrupt_survives_pickling_with_its_result():
    stage = hdfast.sensors.SensorStage([("quantisation", "load_angle")])
    brief = hdfast.Scenario.start_stop(t_end=0.02, t_off=0.01)
    result = hdfast.sweep({"J_l": [0.4, 0.5]}, scenario=brief, t_eval=[0.0, 0.01], metrics=["te_rms"], sensors=stage)
    found = pickle.loads(pickle.dumps(hdfast.Interrupted(result)))
    assert str(found) == "interrupted: 2 of 2 rows finished"
    assert found.result["load_angle"].tolist() == result["load_angle"].tolist()


def strict(inertia):
    return hdfast.sweep({"J_l": [0.4, inertia]}, metrics=[], strict=True, threads=1)


def test_exact_a_pool_tells_the_row_that_cannot_be_simulated():
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        raised = pool.submit(strict, -1.0).exception(timeout=60)
    assert isinstance(raised, hdfast.RowError)
    assert "row 1: J_l = -1 kg" in str(raised)
    assert (raised.row, raised.parameter) == (1, "J_l")
