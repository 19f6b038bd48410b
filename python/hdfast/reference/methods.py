"""The explicit Runge-Kutta pairs: tables of numbers and where they come from."""

from dataclasses import dataclass, field

from . import dop853

Row = dict[int, float]


@dataclass(frozen=True)
class Method:
    """One embedded pair.

    Stage 0 is the slope at the start of the step, the stages of `stages` follow, and the slope at the end of the step
    comes last (it is stage 0 of the next step). `errors` are weights over all of them. All four dense outputs are one
    formula, the cubic Hermite polynomial of the step plus corrections that vanish with their slope at both ends:

    y(x) = y0 + x (F0 + (1-x) (F1 + x (F2 + (1-x) (F3 + x (F4 + ...)))))     x = (t - t0)/h in [0, 1]

    where F0, F1, F2 follow from y0, y1 and the end slopes and F3, F4, ... = h sum(dense row * slopes).
    """

    name: str
    order: int
    dense_order: int
    nodes: list[float]
    stages: list[Row]
    weights: Row
    errors: list[Row]
    error_order: int
    dense: list[Row]
    dense_nodes: list[float] = field(default_factory=list)
    dense_stages: list[Row] = field(default_factory=list)


BS3 = Method(  # Bogacki, Shampine 1989, Appl. Math. Lett. 2(4):321-325
    name="bs3",
    order=3,
    dense_order=3,
    nodes=[1 / 2, 3 / 4],
    stages=[{0: 1 / 2}, {1: 3 / 4}],
    weights={0: 2 / 9, 1: 1 / 3, 2: 4 / 9},
    errors=[{0: -5 / 72, 1: 1 / 12, 2: 1 / 9, 3: -1 / 8}],
    error_order=2,
    dense=[],
)

TSIT5 = Method(  # Tsitouras 2011, Comput. Math. Appl. 62(2):770-775, with its interpolant of order 4
    name="tsit5",
    order=5,
    dense_order=4,
    nodes=[0.161, 0.327, 0.9, 0.9800255409045097, 1.0],
    stages=[
        {0: 0.161},
        {0: -0.008480655492356989, 1: 0.335480655492357},
        {0: 2.8971530571054935, 1: -6.359448489975075, 2: 4.3622954328695815},
        {0: 5.325864828439257, 1: -11.748883564062828, 2: 7.4955393428898365, 3: -0.09249506636175525},
        {
            0: 5.86145544294642,
            1: -12.92096931784711,
            2: 8.159367898576159,
            3: -0.071584973281401,
            4: -0.028269050394068383,
        },
    ],
    weights={
        0: 0.09646076681806523,
        1: 0.01,
        2: 0.4798896504144996,
        3: 1.379008574103742,
        4: -3.290069515436081,
        5: 2.324710524099774,
    },
    errors=[
        {
            0: 0.0017800110522257772,
            1: 0.0008164344596567469,
            2: -0.007880878010261995,
            3: 0.1447110071732629,
            4: -0.5823571654525552,
            5: 0.45808210592918697,
            6: -1 / 66,
        }
    ],
    error_order=4,
    dense=[
        {
            0: -1.0530884977290216,
            1: 0.1017,
            2: 2.490627285651253,
            3: -16.548102889244902,
            4: 47.37952196281928,
            5: -34.87065786149661,
            6: 2.5,
        }
    ],
)

DOPRI5 = Method(  # Dormand, Prince 1980, J. Comput. Appl. Math. 6(1):19-26; dense output Shampine 1986
    name="dopri5",
    order=5,
    dense_order=4,
    nodes=[1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0],
    stages=[
        {0: 1 / 5},
        {0: 3 / 40, 1: 9 / 40},
        {0: 44 / 45, 1: -56 / 15, 2: 32 / 9},
        {0: 19372 / 6561, 1: -25360 / 2187, 2: 64448 / 6561, 3: -212 / 729},
        {0: 9017 / 3168, 1: -355 / 33, 2: 46732 / 5247, 3: 49 / 176, 4: -5103 / 18656},
    ],
    weights={0: 35 / 384, 2: 500 / 1113, 3: 125 / 192, 4: -2187 / 6784, 5: 11 / 84},
    errors=[{0: 71 / 57600, 2: -71 / 16695, 3: 71 / 1920, 4: -17253 / 339200, 5: 22 / 525, 6: -1 / 40}],
    error_order=4,
    dense=[
        {
            0: -12715105075 / 11282082432,
            2: 87487479700 / 32700410799,
            3: -10690763975 / 1880347072,
            4: 701980252875 / 199316789632,
            5: -1453857185 / 822651844,
            6: 69997945 / 29380423,
        }
    ],
)

DOP853 = Method(
    name="dop853",
    order=8,
    dense_order=7,
    nodes=dop853.NODES,
    stages=dop853.STAGES,
    weights=dop853.WEIGHTS,
    errors=[dop853.ERROR_5, dop853.ERROR_3],
    error_order=7,
    dense=dop853.DENSE,
    dense_nodes=dop853.DENSE_NODES,
    dense_stages=dop853.DENSE_STAGES,
)

METHODS = {method.name: method for method in (BS3, TSIT5, DOPRI5, DOP853)}
