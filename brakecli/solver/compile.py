"""How kernels are compiled: one decorator, one cache on disk, and the signatures that plug-ins share.

A scheme or a contact evaluator is handed to the time loop as a compiled function pointer, so that one compiled
loop serves them all and stays in the cache. Kernels neither allocate, raise nor print: they return a status.
"""

import hashlib
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numba import float64, njit, types, void
from numba.core import cgutils
from numba.core import config as numba_config
from numba.extending import intrinsic
from numpy.typing import NDArray

config: Any = numba_config  # its settings come from the environment, so type checkers know none of them
F = TypeVar("F", bound=Callable[..., Any])


class Coefficients(NamedTuple):
    """The constants of (6)-(7) and of the friction law, in the paper's symbols (SI units)."""

    m: float
    b_xx: float
    b_xy: float
    b_yy: float
    c_xx: float
    c_xy: float
    c_yy: float
    sin_beta: float  # Q_x = Q sin(beta)
    cos_beta: float  # Q_y = Q cos(beta)
    phi: float


class Weights(NamedTuple):
    """Step h (s) and weights of a difference scheme; theta_3 is unused by a two-layer scheme."""

    h: float
    theta_1: float
    theta_2: float
    theta_3: float


def source_hash() -> str:
    """Hash of the sources of the solver: otherwise a cached caller would keep the old code of an edited helper."""
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parent.rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def _cache_directory() -> Path | None:
    """Where machine code is kept, or None where nothing can be written (then nothing is cached)."""
    base = os.environ.get("NUMBA_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME")
    try:
        directory = (Path(base) if base else Path.home() / ".cache") / "brakecli" / source_hash()
        directory.mkdir(parents=True, exist_ok=True)
    except (OSError, RuntimeError):
        return None
    return directory if os.access(directory, os.W_OK) else None


CACHE = _cache_directory()


def cache_is_cold() -> bool:
    """Whether kernels have to be compiled first, which takes some seconds."""
    return not config.DISABLE_JIT and (CACHE is None or not any(CACHE.iterdir()))


def kernel(signature: Any, *, fastmath: frozenset[str] = frozenset(), inlined: bool = True) -> Callable[[F], F]:
    """Compile a function ahead of its first call for one signature, strictly (no fastmath unless named).

    A large one that is called in many places is better not `inlined`: compiling takes ten times as long else.
    """

    def compile_(function: F) -> F:
        before, config.CACHE_DIR = config.CACHE_DIR, str(CACHE or config.CACHE_DIR)
        try:
            options: dict[str, Any] = {"fastmath": set(fastmath), "forceinline": inlined}
            try:
                return njit(signature, cache=CACHE is not None, **options)(function)  # type: ignore[no-any-return]
            except OSError:  # a cache that cannot be written or read, on a full disk: do without
                return njit(signature, **options)(function)  # type: ignore[no-any-return]
        finally:
            config.CACHE_DIR = before

    return compile_


vector = float64[::1]
"""A contiguous array of doubles."""

COEFFICIENTS = types.NamedUniTuple(float64, len(Coefficients._fields), Coefficients)
WEIGHTS = types.NamedUniTuple(float64, len(Weights._fields), Weights)

EVALUATE = void(float64, float64, vector, vector, vector)
"""evaluate(x, y, angles, pad, contact): fills `contact` (see `solver.contact`) for a position of the shoe."""

PREPARE = void(COEFFICIENTS, WEIGHTS, vector, float64, float64, float64, vector)
"""prepare(coefficients, weights, state, Q, U_now, U_next, problem): sets up the minimisation of one step."""

FINISH = void(COEFFICIENTS, WEIGHTS, vector, float64, float64, float64, vector, vector, vector)
"""finish(coefficients, weights, state, Q, U_now, U_next, problem, contact, work): the new state, works added."""

# `state`: the motion at the current time level. The names ending in _OLD belong to the level before.
X, Y, VX, VY, X_OLD, Y_OLD, FORCE = range(7)
STATE_SIZE = 7

# `problem`: J(d, e) = a11 d^2/2 + a12 d e + a22 e^2/2 - g1 d - (g2 + F) e + phi F |d - U|, (14) and (25); the
# contact sees the shoe at (x0 + gain d, y0 + gain e). Then its solution.
(A_11, A_12, A_22, G_1, G_2, X_0, Y_0, GAIN, BELT, D, E, F_Y, SIDE, D_SLOPE, E_SLOPE, RESIDUAL) = range(16)
PROBLEM_SIZE = 16

# `contact`: what an evaluator returns (see `brakecli.solver.contact` for each entry), then its scratch.
NORMAL_FORCE, STIFFNESS, TANGENTIAL, FRACTION, STORE, STORE_X, KIND, VALID, SCRATCH = range(9)

# `work`: energies that have passed since the start, J; see `brakecli.solver.energy`.
W_BELT, W_FRICTION, W_DASHPOTS, W_LOAD, W_ROUGHNESS, W_SCHEME, STORE_X_BEFORE, FORCE_BEFORE = range(8)
WORK_SIZE = 8


@intrinsic
def _without_count(typing: Any, array: Any) -> Any:
    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        struct = context.make_array(signature.args[0])(context, builder, arguments[0])
        struct.meminfo = cgutils.get_null_value(struct.meminfo.type)
        return struct._getvalue()

    return array(array), codegen


def _same(array: NDArray[np.float64]) -> NDArray[np.float64]:
    return array


borrowed: Any = _same if config.DISABLE_JIT else _without_count
"""The array without its reference count, which costs a kernel 10 ns for each array that it passes on."""
