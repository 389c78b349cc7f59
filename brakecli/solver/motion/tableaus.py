"""Two Runge-Kutta methods with an error estimate and a continuous solution: DOP853 of order eight, DOPRI5 of five.

Coefficients: E. Hairer, S. P. Nørsett and G. Wanner, Solving Ordinary Differential Equations I, 2nd edition,
sections II.5 and II.6, and their programs dop853.f and dopri5.f. Arrays have DOP853 first. Stage `END_STAGE` is
the slope at the end of the step, which is the first of the next; the three behind it serve the continuous solution
of DOP853 alone. DOPRI5 has no stages from 6 to 11.
"""

import math

import numpy as np

from brakecli.solver.arrays import Floats
from brakecli.solver.block import POWERS, STAGES, Runge
from brakecli.solver.kernels import kernel

END_STAGE = 12
USED, LAST, TERMS, ORDER = np.array([[12, 6], [16, 13], [7, 4], [8, 5]])
"""Stages before the end, stages in all, coefficients of the continuous solution, and the order."""


def _numbers(text: str) -> Floats:
    return np.array([float(word) for word in text.split()])


_EIGHTH = _numbers("""
    0 0.05260015195876773 0.0789002279381516 0.1183503419072274 0.2816496580927726 0.3333333333333333 0.25
    0.3076923076923077 0.6512820512820513 0.6 0.8571428571428571 1 1 0.1 0.2 0.7777777777777778
""")
NODES = np.array([_EIGHTH, [*_numbers("0 0.2 0.3 0.8"), 8 / 9, 1, *[0] * 6, 1, 0, 0, 0]])
"""When each stage is, in steps."""

A = np.zeros((2, STAGES, STAGES))
"""Weights of the slopes so far; those of `END_STAGE` are the step itself."""
A[0][np.tril_indices(STAGES, -1)] = _numbers("""
    0.05260015195876773 0.0197250569845379 0.0591751709536137 0.02958758547680685 0 0.08876275643042054
    0.2413651341592667 0 -0.8845494793282861 0.924834003261792 0.037037037037037035 0 0 0.17082860872947386
    0.12546768756682242 0.037109375 0 0 0.17025221101954405 0.06021653898045596 -0.017578125 0.03709200011850479 0
    0 0.17038392571223998 0.10726203044637328 -0.015319437748624402 0.008273789163814023 0.6241109587160757 0 0
    -3.3608926294469414 -0.868219346841726 27.59209969944671 20.154067550477894 -43.48988418106996
    0.47766253643826434 0 0 -2.4881146199716677 -0.590290826836843 21.230051448181193 15.279233632882423
    -33.28821096898486 -0.020331201708508627 -0.9371424300859873 0 0 5.186372428844064 1.0914373489967295
    -8.149787010746927 -18.52006565999696 22.739487099350505 2.4936055526796523 -3.0467644718982196
    2.273310147516538 0 0 -10.53449546673725 -2.0008720582248625 -17.9589318631188 27.94888452941996
    -2.8589982771350235 -8.87285693353063 12.360567175794303 0.6433927460157636 0.054293734116568765 0 0 0 0
    4.450312892752409 1.8915178993145003 -5.801203960010585 0.3111643669578199 -0.1521609496625161
    0.20136540080403034 0.04471061572777259 0.056167502283047954 0 0 0 0 0 0.25350021021662483 -0.2462390374708025
    -0.12419142326381637 0.15329179827876568 0.00820105229563469 0.007567897660545699 -0.008298 0.03183464816350214
    0 0 0 0 0.028300909672366776 0.053541988307438566 -0.05492374857139099 0 0 -0.00010834732869724932
    0.0003825710908356584 -0.00034046500868740456 0.1413124436746325 -0.42889630158379194 0 0 0 0
    -4.697621415361164 7.683421196062599 4.06898981839711 0.3567271874552811 0 0 0 -0.0013990241651590145
    2.9475147891527724 -9.15095847217987
""")
A[1, 1:6, :5] = [
    [1 / 5, 0, 0, 0, 0],
    [3 / 40, 9 / 40, 0, 0, 0],
    [44 / 45, -56 / 15, 32 / 9, 0, 0],
    [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0],
    [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656],
]
A[1, END_STAGE, :6] = 35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84

THIRD = np.zeros_like(NODES)
ERROR_WEIGHTS = np.zeros_like(NODES)
DENSE = np.zeros((2, POWERS - 3, STAGES))
THIRD[0, : END_STAGE + 1] = _numbers("""
    -0.18980075407240762 0 0 0 0 4.450312892752409 1.8915178993145003 -5.801203960010585 -0.4226823213237919
    -0.1521609496625161 0.20136540080403034 0.02265179219836082 0
""")
ERROR_WEIGHTS[0, : END_STAGE + 1] = _numbers("""
    0.01312004499419488 0 0 0 0 -1.2251564463762044 -0.4957589496572502 1.6643771824549864 -0.35032884874997366
    0.3341791187130175 0.08192320648511571 -0.022355307863886294 0
""")
ERROR_WEIGHTS[1, [*range(6), END_STAGE]] = (
    71 / 57600,
    0,
    -71 / 16695,
    71 / 1920,
    -17253 / 339200,
    22 / 525,
    -1 / 40,
)
"""What the step differs by from formulas of order three and five, of DOPRI5 from one of order four."""

DENSE[0] = _numbers("""
    -8.428938276109013 0 0 0 0 0.5667149535193777 -3.0689499459498917 2.38466765651207 2.117034582445028
    -0.871391583777973 2.2404374302607883 0.6315787787694688 -0.08899033645133331 18.148505520854727
    -9.194632392478356 -4.436036387594894 10.427508642579134 0 0 0 0 242.28349177525817 165.20045171727028
    -374.5467547226902 -22.113666853125306 7.733432668472264 -30.674084731089398 -9.332130526430229
    15.697238121770845 -31.139403219565178 -9.35292435884448 35.81684148639408 19.985053242002433 0 0 0 0
    -387.0373087493518 -189.17813819516758 527.8081592054236 -11.57390253995963 6.8812326946963 -1.0006050966910838
    0.7777137798053443 -2.778205752353508 -60.19669523126412 84.32040550667716 11.99229113618279 -25.69393346270375
    0 0 0 0 -154.18974869023643 -231.5293791760455 357.6391179106141 93.40532418362432 -37.45832313645163
    104.0996495089623 29.8402934266605 -43.53345659001114 96.32455395918828 -39.17726167561544 -149.72683625798564
""").reshape(POWERS - 3, STAGES)
DENSE[1, 0, [0, 2, 3, 4, 5, END_STAGE]] = (
    -12715105075 / 11282082432,
    87487479700 / 32700410799,
    -10690763975 / 1880347072,
    701980252875 / 199316789632,
    -1453857185 / 822651844,
    69997945 / 29380423,
)
"""The upper coefficients of the continuous solution."""


@kernel(inline=False)
def combine(r: Runge, begin: Floats, h: float, stage: int) -> None:
    """The state at a stage of a step h: begin + h Σ A[stage, j] k_j."""
    pair = r.pair
    for i in range(4):
        total = 0.0
        for j in range(stage if pair == 0 else min(stage, USED[pair])):
            total += A[pair, stage, j] * r.slopes[j, i]
        r.w[i] = begin[i] + h * total


@kernel
def local_error(r: Runge, component: int) -> float:
    """The error of one component in a step, over the step: of order seven, from those of order three and five.

    e_5²/√(e_5² + e_3²/100), each e a sum of weighted slopes; of DOPRI5 |e| itself.
    """
    third = 0.0
    fifth = 0.0
    pair = r.pair
    for j in range(USED[pair]):
        third += THIRD[pair, j] * r.slopes[j, component]
        fifth += ERROR_WEIGHTS[pair, j] * r.slopes[j, component]
    if pair == 1:
        return abs(fifth + ERROR_WEIGHTS[1, END_STAGE] * r.slopes[END_STAGE, component])  # type: ignore[no-any-return]
    size = math.sqrt(fifth * fifth + 0.01 * third * third)
    return fifth * fifth / size if size > 0.0 else 0.0


@kernel
def make_continuous(r: Runge, begin: Floats, h: float) -> None:
    """Coefficients of the continuous solution, from the slopes and both ends of a step h.

    p_0 is the change, p_1 = h k_first - p_0, p_2 = 2 p_0 - h (k_first + k_last), and the others are h Σ D k.
    """
    pair = r.pair
    r.length = h
    for i in range(4):
        first = h * r.slopes[0, i]
        last = h * r.slopes[END_STAGE, i]
        change = r.end[i] - begin[i]
        r.begin[i] = begin[i]
        r.powers[0, i] = change
        r.powers[1, i] = first - change
        r.powers[2, i] = 2.0 * change - (first + last)
        for p in range(TERMS[pair] - 3):
            total = 0.0
            for j in range(LAST[pair]):
                total += DENSE[pair, p, j] * r.slopes[j, i]
            r.powers[p + 3, i] = h * total


@kernel
def interpolated(r: Runge, component: int, theta: float) -> float:
    """One component at the part theta of the step that the continuous solution belongs to.

    u = u_0 + θ (p_0 + (1 - θ) (p_1 + θ (p_2 + (1 - θ) (p_3 + …)))).
    """
    total = 0.0
    complement = 1.0 - theta
    for p in range(TERMS[r.pair] - 1, -1, -1):
        total = (total + r.powers[p, component]) * (theta if p % 2 == 0 else complement)
    return r.begin[component] + total  # type: ignore[no-any-return]


@kernel
def reach(r: Runge, component: int) -> float:
    """A bound of how far one component of the continuous solution gets from the begin of its step.

    |p_0| + |p_1|/4 + 4 |p_2|/27 + Σ |p_k|/16: the largest sizes of θ, θ(1 - θ), θ²(1 - θ), and of products of
    four.
    """
    far = abs(r.powers[0, component]) + abs(r.powers[1, component]) / 4.0
    far += abs(r.powers[2, component]) * 4.0 / 27.0
    for p in range(3, TERMS[r.pair]):
        far += abs(r.powers[p, component]) / 16.0
    return far  # type: ignore[no-any-return]


@kernel
def interpolated_both(r: Runge, component: int, theta: float) -> tuple[float, float]:
    """`interpolated`, and its derivative by theta."""
    total = 0.0
    slope = 0.0
    complement = 1.0 - theta
    for p in range(TERMS[r.pair] - 1, -1, -1):
        total += r.powers[p, component]
        if p % 2 == 0:
            slope = slope * theta + total
            total = total * theta
        else:
            slope = slope * complement - total
            total = total * complement
    return r.begin[component] + total, slope
