"""The smallest local ratio against the steepest slope of a whole period of the kinematic error."""

import hdfast
import numpy as np
import pytest
from drives import AMPLITUDES, ORDERS, PHASES

RATIO = 121.0
SHORT = hdfast.Scenario.start_stop(t_end=0.02, t_off=0.01)


def smallest(row, **model):
    found = hdfast.sweep(row, model=hdfast.Model(**model), scenario=SHORT, metrics=["upsilon_min"])
    return found["upsilon_min"][0]


@pytest.mark.parametrize(
    ("orders", "turns"),
    [(["1/2"], 2), (["1/2", "1/3"], 6), (["1/121", "120/121", 2, "240/121", "7/2"], 242), ([1, "2/3", 9], 3)],
)
def test_exact_orders_that_repeat_after_several_turns(orders, turns):
    model = hdfast.Model(orders=orders)
    row = {f"te_cos_{order}": 3e-5 for order in orders} | {f"te_sin_{order}": 1e-5 for order in orders}
    theta = np.linspace(0.0, 2 * np.pi * turns, 1_000_001)
    slope = sum(n * (1e-5 * np.cos(n * theta) - 3e-5 * np.sin(n * theta)) for n in model.order_values)
    assert smallest(row, orders=orders) == pytest.approx(1 / RATIO - slope.max(), abs=1e-5 * slope.max())


@pytest.mark.parametrize("order", [1.0, 7.5, 240.0, 10_000.0])
def test_exact_pulses_of_a_local_fault(order):
    height, width = 2e-6, 0.05
    x = np.linspace(-8 * width, 0.0, 200_001)
    slope = -order * height * np.sin(x) / width**2 * np.exp((np.cos(x) - 1) / width**2)
    row = {"fault_height": height, "order": order, "fault_width": width, "te_scale": 0.0}
    assert smallest(row, terms=["local_fault"]) == pytest.approx(1 / RATIO - slope.max(), abs=1e-4 * slope.max())


@pytest.mark.parametrize("order", [6.0, 240.0])
def test_exact_pulses_beside_the_orders_of_the_gear(order):
    height, width, psi = 5e-6, 0.05, 0.7
    theta = np.linspace(0.0, 2 * np.pi, 2_000_001)
    phase = order * theta + psi
    pulse = height * np.exp((np.cos(phase) - 1) / width**2)
    slope = -order * np.sin(phase) / width**2 * pulse
    slope += sum(n * a * np.cos(n * theta + p) for n, a, p in zip(ORDERS, AMPLITUDES, PHASES, strict=True))
    row = {"fault_height": height, "order": order, "fault_width": width, "psi": psi}
    assert smallest(row, terms=["local_fault"]) == pytest.approx(1 / RATIO - slope.max(), abs=3e-4 * slope.max())
