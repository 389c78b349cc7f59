"""How kernels are compiled: one decorator, and calls by address.

A scheme or a contact evaluator is handed to the time loop as the address of its machine code, so that one compiled
loop serves them all and stays in the cache. Kernels neither allocate, raise nor print: they return a status.
"""

import sys
from collections.abc import Callable
from functools import cache
from typing import Any, TypeVar

import numpy as np
from numba import boolean, float64, int64, types
from numba.core import cgutils
from numba.core import event as numba_events
from numba.core.compiler_lock import global_compiler_lock
from numba.core.registry import CPUDispatcher
from numba.extending import intrinsic
from numpy.typing import NDArray

from brakecli.solver import beforehand, compiling
from brakecli.solver.kernel_cache import compile_for, config, is_cached, not_compiled

Floats = NDArray[np.float64]
vector = float64[::1]
"""A contiguous array of doubles, for the compiler."""
FAST = frozenset({"reassoc", "contract", "nsz"})
"""What fast loops allow: sums in any order, fused multiply-add, no signed zeros; NaN stays NaN."""

kernels: list[Any] = []
"""Every kernel of this process, in the order of their definition."""

events: Any = numba_events  # has no types
F = TypeVar("F", bound=Callable[..., Any])


def _leave_out_blas() -> None:
    """Load Numba's functions of arrays without SciPy's BLAS: its import takes 0.1 s, and no kernel calls it."""
    name = "scipy.linalg.cython_blas"
    if name not in sys.modules:
        sys.modules[name] = None  # type: ignore[assignment]  # whoever imports it learns that there is none
        from numba.np import arraymath

        del sys.modules[name]
        arraymath._HAVE_BLAS = True  # kernels of others find it as before


_leave_out_blas()


class _Compiling(events.Listener):  # type: ignore[misc]
    """Hears of every kernel that Numba compiles; one that the cache holds is loaded instead."""

    def on_start(self, event: Any) -> None:
        compiling.begins()

    def on_end(self, event: Any) -> None:
        pass


events.register("numba:compile", _Compiling())


class _Waiting(CPUDispatcher):
    """A kernel that is loaded when it is first called: a run calls a quarter of those that it imports.

    One for other kernels alone has no wrapper for calls from Python, which would otherwise end the process.
    """

    signature: Any
    private = True

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        if self.private:
            name = vars(self)["__name__"]
            raise TypeError(f"{name} has no wrapper for calls from Python: only other kernels can call it")
        return ready(self)(*arguments, **named)

    def __reduce__(self) -> Any:
        """One that is loaded says what is compiled, also for another process."""
        return super().__reduce__() if self.private else ready(self).__reduce__()

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """What the compiler asks for where another kernel calls this one."""
        return CPUDispatcher.get_call_template(ready(self), args, kws)


def ready(function: Any) -> Any:
    """A kernel whose machine code has been loaded, or compiled: where it is not to be loaded by its first call."""
    if isinstance(function, _Waiting):
        with global_compiler_lock:
            if not function.overloads:
                compile_for(function, function.signature)
        if not function.private:  # its calls take no way through Python; another thread may have done so meanwhile
            function.__class__ = CPUDispatcher  # type: ignore[assignment]
    return function


def is_kept(kernel: Any) -> bool:
    """Whether the cache holds a kernel."""
    return is_cached(kernel, kernel.signature)


def kernel(signature: Any, *, fastmath: frozenset[str] = frozenset(), inlined: bool = True) -> Callable[[F], F]:
    """Compile a function for one signature, strictly (no fastmath unless named), ahead of its first call.

    A large one that is called in many places is better not `inlined`: otherwise compilation takes ten times
    longer. Such a one, and one whose name begins with an underscore, is for other kernels alone: it has no wrapper
    for calls from Python, whose compilation takes as long as its own.
    """

    def compile_(function: F) -> F:
        private = not inlined or function.__name__.startswith("_")
        options: dict[str, Any] = {"fastmath": set(fastmath), "forceinline": inlined, "no_cfunc_wrapper": True}
        options["no_cpython_wrapper"] = private
        compiled: Any = not_compiled(function, options)
        if not config.DISABLE_JIT:
            compiled.__class__ = _Waiting
            compiled.signature = signature
            compiled.private = private
            kernels.append(compiled)
            if beforehand.is_lazy() and not private and not is_kept(compiled):  # before anything is timed
                ready(compiled)
        return compiled  # type: ignore[no-any-return]

    return compile_


_functions: list[Any] = []  # interpreted kernels, found by their number


@cache
def address(function: Any) -> int:
    """Where the machine code of a kernel is. An interpreted one gets a number instead."""
    if config.DISABLE_JIT:
        if function not in _functions:
            _functions.append(function)
        return _functions.index(function)
    (compiled,) = ready(function).overloads.values()
    return int(compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name))


def at_address(signature: Any) -> Any:
    """What turns the address of a kernel of this signature into a function that compiled code can call.

    The conversion costs nothing, whereas a function that is handed to compiled code costs 0.2 ms in each call.
    """
    function = types.FunctionType(signature)

    @intrinsic
    def callable_at(typing: Any, address: Any) -> Any:
        def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            pointers = cgutils.create_struct_proxy(function)(context, builder)
            pointers.c_addr = pointers.py_addr = cgutils.get_null_value(cgutils.voidptr_t)
            pointers.jit_addr = builder.inttoptr(arguments[0], cgutils.voidptr_t)
            return pointers._getvalue()

        return function(types.int64), codegen

    return _functions.__getitem__ if config.DISABLE_JIT else callable_at


@intrinsic
def _byte_at(typing: Any, address: Any) -> Any:
    """The byte at an address, read anew each time."""

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        place = builder.inttoptr(arguments[0], cgutils.voidptr_t)
        return builder.zext(builder.load_atomic(place, "monotonic", 1), cgutils.intp_t)

    return types.intp(types.int64), codegen


_first_byte: Any = (lambda address: 0) if config.DISABLE_JIT else _byte_at  # interpreted ones are interrupted


@kernel(boolean(int64))
def stopped(signals: int) -> bool:
    """Whether the process has been told to end: Python does so as soon as kernels return, whatever they return.

    `signals` is the address of `brakecli.stop.memory`.
    """
    number: int = _first_byte(signals)
    return number == 1 or number == 2 or number == 15  # SIGHUP, SIGINT, SIGTERM


def _without_counts(context: Any, builder: Any, type_: Any, value: Any) -> Any:
    """The value with the reference count of every array in it removed."""
    if isinstance(type_, types.Array):
        array = context.make_array(type_)(context, builder, value)
        array.meminfo = cgutils.get_null_value(array.meminfo.type)
        return array._getvalue()
    if isinstance(type_, types.BaseTuple):
        members: Any = type_
        for index, member in enumerate(members):
            item = _without_counts(context, builder, member, builder.extract_value(value, index))
            value = builder.insert_value(value, item, index)
    return value


@intrinsic
def _borrowed(typing: Any, value: Any) -> Any:
    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return _without_counts(context, builder, signature.args[0], arguments[0])

    return value(value), codegen


borrowed: Any = (lambda value: value) if config.DISABLE_JIT else _borrowed
"""A tuple whose arrays have no reference counts, which cost a kernel 10 ns for each array that it passes on."""


LARGEST = 2048
"""Bytes that a tuple in memory may take."""
_tuples: dict[int, Any] = {}  # interpreted: those in memory, by their address


@intrinsic
def _put(typing: Any, value: Any, address: Any) -> Any:
    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        kind = arguments[0].type
        assert context.get_abi_sizeof(kind) <= LARGEST
        builder.store(arguments[0], builder.inttoptr(arguments[1], kind.as_pointer()))
        return context.get_dummy_value()

    return types.void(value, types.int64), codegen


_kept: Any = (lambda value, address: _tuples.update({address: value})) if config.DISABLE_JIT else _put


def into_memory(type_: Any) -> Any:
    """A kernel for Python that puts a tuple of this type into memory, where `from_memory` finds it.

    A call from Python converts every member of a tuple that it hands over, which takes 14 µs for a `Plant`.
    """

    @kernel(types.void(type_, int64))
    def hold(value: Any, address: int) -> None:
        _kept(borrowed(value), address)

    return hold


def from_memory(type_: Any) -> Any:
    """For kernels: the tuple at an address, of this type or of one that has other records."""

    @intrinsic
    def taken(typing: Any, address: Any) -> Any:
        def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            place = context.get_value_type(type_).as_pointer()
            return builder.load(builder.inttoptr(arguments[0], place))

        return type_(types.int64), codegen

    return _tuples.__getitem__ if config.DISABLE_JIT else taken
