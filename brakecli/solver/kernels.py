"""Kernels: functions that Numba compiles. Those that Python calls are entries; the others are for kernels.

An entry has a signature; the types of what it calls are inferred. All entries are compiled before one is called,
by child processes (`beforehand`), and each is loaded by its first call. Kernels neither allocate, raise nor
print: they return a status. With NUMBA_DISABLE_JIT=1 all of them are interpreted. Numba is imported with the first
entry that is loaded, as that takes half a second.
"""

import os
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from threading import RLock
from types import ModuleType
from typing import Generic, ParamSpec, TypeVar, overload

from brakecli.solver import beforehand, cache_folder, compiling
from brakecli.solver.records import Record

FAST = frozenset({"reassoc", "contract", "nsz"})
"""What fast loops allow: sums in any order, fused multiply-add, no signed zeros; NaN stays NaN."""

P = ParamSpec("P")
R = TypeVar("R", covariant=True)
F = TypeVar("F", bound=Callable[..., object])
Argument = type[float] | type[int] | type[Record] | list[type[Record]] | int | None
"""A type in the signature of an entry, see `entry`."""
INTERPRETED = (os.environ.get("NUMBA_DISABLE_JIT") or "0") != "0"
"""Whether all kernels are interpreted."""
entries: list["Entry[..., object]"] = []
"""Every entry of this process, in the order of their definition."""

_locks = [RLock()]  # the last one is that of loading; a forked process gets another: nobody there lets go of ours
os.register_at_fork(after_in_child=lambda: _locks.append(RLock()))
_unknown: list[tuple[Callable[..., object], dict[str, object]]] = []  # kernels that the compiler has not heard of
_DECIDING = (
    "NUMBA_CPU_NAME",
    "NUMBA_CPU_FEATURES",
    "NUMBA_ENABLE_AVX",
    "NUMBA_BOUNDSCHECK",
    "NUMBA_DEBUGINFO",
    "NUMBA_LOOP_VECTORIZE",
    "NUMBA_SLP_VECTORIZE",
)
"""Variables of the environment that decide what machine code Numba writes."""


@overload
def kernel(function: F, /) -> F: ...
@overload
def kernel(*, fastmath: frozenset[str] = ..., inline: bool = ...) -> Callable[[F], F]: ...
def kernel(
    function: F | None = None, /, *, fastmath: frozenset[str] = frozenset(), inline: bool = True
) -> F | Callable[[F], F]:
    """A function for kernels, strict (no fastmath unless named). Called from Python, it is interpreted.

    A large one, or one that is called in many places, is better not `inline`: its callers would take longer to
    compile. Kernels allocate nothing and return no arrays (`_nrt`), so that none is counted at each call.
    """

    def made(function: F) -> F:
        _unknown.append((function, {"fastmath": set(fastmath), "forceinline": inline, "_nrt": False}))
        return function

    return made if function is None else made(function)


class Entry(Generic[P, R]):
    """A kernel that Python calls: its first call loads it from the cache, which holds all of them by then."""

    def __init__(self, function: Callable[P, R], types: tuple[Argument, ...]) -> None:
        """From what is compiled, and the types of its result and of its arguments."""
        self.function = function
        self.types = types
        self.name = f"{function.__module__.removeprefix('brakecli.solver.')}.{function.__qualname__}"
        self._machine_code: Callable[P, R] | None = None

    def __call__(self, *arguments: P.args, **named: P.kwargs) -> R:
        """What the compiled function gives."""
        return (self._machine_code or self.load())(*arguments, **named)

    def load(self) -> Callable[P, R]:
        """The compiled function: for who times it, or calls it often."""
        with _locks[-1]:
            if self._machine_code is None:
                self._machine_code = _loaded(self)
            return self._machine_code

    @property
    def folder(self) -> Path | None:
        """Where its machine code is kept, if it can be."""
        whole = folder()
        return whole / self.name if whole else None


def entry(*types: Argument) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """A kernel that Python calls, with the type of its result and those of its arguments.

    A type is None, float, int, that of a record, [that of a record] for an array of one, or the dimensions of an
    array of doubles. A call takes 40 µs to see what a large record is, and 1 µs with an array of it.
    """

    def register(function: Callable[P, R]) -> Callable[P, R]:
        if INTERPRETED:
            return function
        entries.append(made := Entry(function, types))
        return made

    return register


def load(function: Callable[P, R]) -> Callable[P, R]:
    """The compiled function of an entry; one that is interpreted is taken as it is."""
    return function.load() if isinstance(function, Entry) else function


@cache
def folder() -> Path | None:
    """Where machine code is kept; None where it cannot be."""
    return cache_folder.opened(_facts())


@cache
def _numba() -> ModuleType:
    """Numba. It optimises as it does for `beforehand`, which takes a tenth less memory than its default."""
    os.environ.setdefault("NUMBA_OPT", beforehand.OPTIMISATION)
    import numba

    return numba


@cache
def _facts() -> dict[str, str]:
    """What kernels depend on beside their sources."""
    import llvmlite
    from llvmlite import binding

    return {
        "python": f"{sys.version} {sys.flags.optimize}",
        "numba": _numba().__version__,
        "llvmlite": llvmlite.__version__,
        "processor": f"{binding.get_host_cpu_name()} {binding.get_host_cpu_features().flatten()}",
        "path": str(Path(__file__).parent),
        **{name: os.environ[name] for name in _DECIDING if name in os.environ},
    }


def _loaded(own: Entry[P, R]) -> Callable[P, R]:
    """An entry from the cache, which then holds all of them, or compiled where there is none."""
    machine_code = own.folder
    if machine_code is not None and _prepare() and not beforehand.is_sound(machine_code):
        _mend()
    sound = machine_code is not None and beforehand.is_sound(machine_code) and beforehand.is_ours(machine_code)
    if not sound:
        compiling.begins()
        machine_code = machine_code and beforehand.emptied(machine_code)
    numba = compiler()
    signature = _type(numba, own.types[0])(*(_type(numba, type_) for type_ in own.types[1:]))
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(machine_code)
    try:
        with compiling.without_blas():
            compiled = numba.njit(signature, cache=machine_code is not None, _nrt=False)(own.function)
        if machine_code is not None and not sound:
            with suppress(OSError):  # the next process compiles it again
                beforehand.vouch(machine_code)
    except Exception:  # the cache cannot be read or written after all, as on a full disk: do without
        compiled = numba.njit(signature, _nrt=False)(own.function)
    finally:
        numba.config.CACHE_DIR = before
    return compiled  # type: ignore[no-any-return]


def _type(numba: ModuleType, type_: Argument) -> Callable[..., object]:
    """The compiler's word for a type in the signature of an entry."""
    if isinstance(type_, list):
        return numba.types.Array(numba.from_dtype(type_[0].layout), 1, "C")  # type: ignore[no-any-return]
    if isinstance(type_, int):
        return numba.types.Array(numba.float64, type_, "C")  # type: ignore[no-any-return]
    if isinstance(type_, type) and issubclass(type_, Record):
        return numba.from_dtype(type_.layout)  # type: ignore[no-any-return]
    return {None: numba.void, int: numba.int64, float: numba.float64}[type_]  # type: ignore[no-any-return]


@cache
def _prepare() -> bool:
    """See to it once that the cache holds all entries; whether it does. What keeps it from that is told."""
    whole = folder()
    assert whole is not None
    if why := beforehand.prepare(whole, _facts()):
        compiling.warn(why)
    return not why and not beforehand.is_lazy() and not beforehand.is_child()


def _mend() -> None:
    """Have all entries of a damaged cache compiled anew."""
    whole = folder()
    assert whole is not None
    try:
        beforehand.forget(whole)
    except OSError as error:
        why = f"{(error.strerror or str(error)).lower()} (found {error.filename})"
        what = f"the cache of compiled kernels is damaged, and cannot be mended: {why}"
        compiling.warn(f"{what}; {cache_folder.REMEDY}")
    else:
        _prepare.cache_clear()
        _prepare()


def compiler() -> ModuleType:
    """Numba, which knows all kernels that have been imported."""
    numba = _compiler()
    while _unknown:
        function, options = _unknown[-1]
        numba.extending.register_jitable(**options)(function)
        _unknown.pop()  # only now: Ctrl-C may come in between
    return numba


@cache
def _compiler() -> ModuleType:
    """Numba, which knows how to read the byte of a signal."""
    numba = _numba()
    from llvmlite import ir
    from numba.extending import intrinsic
    from numba.extending import overload as overload_of

    @intrinsic
    def byte_at(typing: object, address: object) -> tuple[object, object]:
        """The byte at an address, read anew each time."""

        def codegen(
            context: object, builder: ir.IRBuilder, signature: object, arguments: list[ir.Value]
        ) -> ir.Value:
            pointer = builder.inttoptr(arguments[0], ir.IntType(8).as_pointer())
            return builder.zext(builder.load_atomic(pointer, "monotonic", 1), ir.IntType(64))

        return numba.int64(numba.int64), codegen

    @overload_of(_first_byte, strict=False)
    def compiled(address: object) -> Callable[[object], object]:
        return lambda address: byte_at(address)  # type: ignore[call-arg]  # the compiler gives the first

    return numba


def _first_byte(address: int) -> int:
    """The byte at an address; 0 where kernels are interpreted, which exceptions end."""
    return 0


@kernel
def stopped(signals: int) -> bool:
    """Whether the process has been told to end: Python does so as soon as kernels return, whatever they return.

    `signals` is the address of `brakecli.stop.memory`.
    """
    number = _first_byte(signals)
    return number == 1 or number == 2 or number == 15  # SIGHUP, SIGINT, SIGTERM
