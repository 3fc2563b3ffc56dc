"""Two decorators for compiled kernels: cached on disk, no GIL, no fastmath, one signature where one will do.

`fastmath` stays off because NaN and infinity mean something here ("no root", "not hit").

numba counts who refers to an array: an atomic addition for every array that a function is given and for every row it
looks at, another one afterwards, and nothing is kept in a register across them. That was measured to be half of the
time of small functions, so what makes no arrays is a `leaf`: it borrows those of its caller, who keeps them.
The option behind it is one that numba uses for its own intrinsics and does not promise to users; `tests/test_jit.py`
tells if it ever means something else.

Compilation is time that users wait for. numba compiles a function once more for every number or truth value that a
caller writes out (`f(a, 2)` besides `f(a, k)`), and once more for arrays that are read-only; here written-out values are
of their plain type, and callers hand over contiguous arrays that may be written to.

The cache costs no correctness. numba asks only whether the file of a function changed; here what its file imports and this
file count too. A cache that cannot be written, or that is damaged, is as good as none.
"""

from __future__ import annotations

import hashlib
import re
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from llvmlite.binding import Linkage, parse_assembly, parse_bitcode
from numba.core import event, types
from numba.core.codegen import CPUCodeLibrary
from numba.core.runtime.nrt import rtsys

from vmachining.notice import notice

F = TypeVar("F", bound=Callable[..., Any])

OPTIMIZE = "_optimize_final_module"
"""Step of numba in which a library and all that it links are one module."""

IMPORT = re.compile(r"^from ((?:vmachining|benchmarks)[\w.]*) import ", re.MULTILINE)


def kernel(function: F) -> F:
    """Compile `function` in nopython mode."""
    return cast(F, _compiled(function))


def leaf(function: F) -> F:
    """Compile a function that makes no arrays, and calls none that does; one that did would not compile."""
    return cast(F, _compiled(function, _nrt=False))


def inner(function: F) -> F:
    """A `leaf` whose code is put where it is called: for steps of an inner loop with so many numbers that handing them over
    costs as much as the step."""
    return cast(F, _compiled(function, _nrt=False, forceinline=True))


def within(function: F) -> F:
    """A `leaf` that is compiled as part of its only caller: long functions are optimized once instead of once per caller."""
    return cast(F, _compiled(function, _nrt=False, inline="always"))


class _Compiling(event.Listener):
    """Passes the first compilation on, see `notice.compiling`; the last in the stack is compiled now, for those before it."""

    def __init__(self) -> None:
        self.stack: list[Any] = []

    def on_start(self, event: Any) -> None:
        self.stack.append(event.data["dispatcher"])
        tell, notice.compiling = notice.compiling, None
        if tell is not None:
            tell()

    def on_end(self, event: Any) -> None:
        self.stack.pop()


compiling = _Compiling()
event.register("numba:compile", compiling)


def _closing(optimize: Callable[[Any], None]) -> Callable[[Any], None]:
    """The step `optimize`, before which functions that a kernel links in become its own.

    numba hands over an array as seven numbers and more, most of which nobody reads. LLVM leaves out those that a function does
    not need, and inlines what has one caller, but only where nobody else can call it: a tenth to a fifth of the time of
    kernels of many small functions.
    """

    def closed(library: Any) -> None:
        if compiling.stack and getattr(compiling.stack[-1], "closed", False):
            for function in library._final_module.functions:
                if not function.is_declaration and function.linkage == Linkage.linkonce_odr:
                    # private, not internal: without a symbol that other libraries would take for their own function
                    function.linkage = Linkage.private
        optimize(library)

    return closed


if hasattr(CPUCodeLibrary, OPTIMIZE):  # without it kernels are right, and slower
    setattr(CPUCodeLibrary, OPTIMIZE, _closing(getattr(CPUCodeLibrary, OPTIMIZE)))


def _compiled(function: Callable[..., Any], **options: Any) -> Any:
    options |= {"nogil": True, "fastmath": False, "error_model": "numpy"}
    made: Any
    try:
        made = numba.njit(cache=True, **options)(function)
    except (RuntimeError, OSError):  # no place for a cache: compile in every session
        made = numba.njit(**options)(function)
    if not hasattr(made, "get_call_template"):  # a plain function under NUMBA_DISABLE_JIT
        return made
    made.closed = options.get("_nrt", True)
    chosen = made.get_call_template
    made.get_call_template = lambda args, keys: chosen(
        tuple(map(types.unliteral, args)), {name: types.unliteral(value) for name, value in keys.items()}
    )
    if hasattr(made._cache, "_index_key"):
        _guard(made._cache, function)
    return made


def _guard(store: Any, function: Callable[..., Any]) -> None:
    """Make a cache of numba know what its function imports, survive what is wrong with its files, and load machine code alone.

    Its own `load_overload` first loads all that the compiler knows, scipy.linalg among it, and reads what is needed to put a
    kernel into another: half a second at every start. A compiler loads both by itself when there is something to compile.
    """
    load, save, key, rebuild = (
        store._load_overload,
        store.save_overload,
        store._index_key,
        store._impl.rebuild,
    )

    def guarded_load(signature: Any, context: Any) -> Any:
        rtsys.initialize(context)  # counters of arrays
        try:
            return load(signature, context)
        except Exception:  # whatever a damaged file makes of it: the function is compiled anew
            return None

    def guarded_save(signature: Any, data: Any) -> None:
        with suppress(Exception):  # full, read-only, damaged: the next session compiles again
            save(signature, data)

    def quick_rebuild(context: Any, payload: Any) -> Any:
        try:
            (name, kind, (code, bitcode)), described, *rest = payload
            context.codegen()._engine._defined_symbols.add(described.llvm_cpython_wrapper_name)
            made = rebuild(context, ((name, kind, (code, parse_assembly("").as_bitcode())), described, *rest))
            made.library._get_module_for_linking = cache(lambda: parse_bitcode(bitcode))
        except (TypeError, ValueError, AttributeError):  # a numba that keeps other things: its own way
            context.refresh()
            made = rebuild(context, payload)
        return made

    store.load_overload, store.save_overload, store._impl.rebuild = guarded_load, guarded_save, quick_rebuild
    store._index_key = lambda signature, codegen: (*key(signature, codegen), imported(function.__module__))


@cache
def imported(module: str) -> str:
    """Fingerprint of the sources of ours that a module imports, directly or not."""
    found: set[str] = set()
    todo = [module]
    digest = hashlib.sha256(Path(__file__).read_bytes())  # how kernels are compiled
    while todo:
        name = todo.pop()
        if name in found or (text := _source(name)) is None:
            continue
        found.add(name)
        todo += IMPORT.findall(text)
    for name in sorted(found):
        digest.update(f"{name}\n{_source(name)}\n".encode())
    return digest.hexdigest()


@cache
def _source(module: str) -> str | None:
    """Text of a module of kernels; None of others, which hold constants at most that numba never sees."""
    if not module.endswith("_kernels"):
        return None
    path = getattr(sys.modules.get(module), "__file__", None)
    return None if path is None else Path(path).read_text(encoding="utf-8")


def forget_sources() -> None:
    """Read sources anew, see `imported`."""
    imported.cache_clear()
    _source.cache_clear()
