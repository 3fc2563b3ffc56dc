"""Compiled functions: what borrows arrays may not make any."""

from __future__ import annotations

import os
import subprocess
import sys
from types import ModuleType

import numba
import numpy as np
import pytest

from vmachining.jit import forget_sources, imported, kernel, leaf


def make_row(n):
    return np.zeros(n)


def make_another(n):  # what is compiled is remembered by function, whatever the decorator
    return np.zeros(n)


def row_sum(table, k):
    row = table[k]
    total = 0.0
    for value in row:
        total += value
    return total


def test_a_leaf_that_makes_an_array_does_not_compile():
    assert kernel(make_row)(3).tolist() == [0.0, 0.0, 0.0]
    with pytest.raises(numba.NumbaError):
        leaf(make_another)(3)


def test_a_leaf_leaves_the_arrays_of_its_caller_alone():
    table = np.arange(6.0).reshape(2, 3)
    compiled = leaf(row_sum)
    for _ in range(1000):
        assert compiled(table, 1) == 12.0
    views = [table[k] for k in range(2)]
    assert [compiled(table[::-1], k) for k in range(2)] == [12.0, 3.0]
    assert table.base is not None and [v.tolist() for v in views] == [[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]]


def picked(row, k):
    return row[k]


def both(row, k):
    return picked_compiled(row, k) + picked_compiled(row, 1)


picked_compiled = leaf(picked)


def test_numbers_that_are_written_out_make_no_other_signature():
    assert numba.njit(both)(np.arange(3.0), 2) == 3.0  # not cached: it is compiled now
    assert len(picked_compiled.signatures) == 1


LINKED = """
import numpy as np
from vmachining.jit import kernel, leaf

row = np.full(10, 1.0)

@leaf
def steps(row, n):  # calls itself, so nobody inlines it
    return 0.0 if n < 1 else row[n] + steps(row, n // 2) + steps(row, n - 2)

@leaf
def doubled(row, n):
    return 2.0 * steps(row, n)

@kernel
def counted(row, n):
    return doubled(row, n)

print(counted(row, 9), doubled(row, 9))
(made,) = counted.overloads.values()
if not made.library._disable_inspection:  # compiled now
    text = made.library.get_llvm_str()
    print(text.count("define private") > 0, text.count("define linkonce_odr"))
"""


def test_what_a_kernel_links_in_is_its_own(tmp_path):
    """Else LLVM keeps all numbers of all arrays that are handed over. Others call the function as it was."""
    program = tmp_path / "linked.py"
    program.write_text(LINKED)
    assert said(program, tmp_path / "cache") == ["32.0", "32.0", "True", "0"]
    assert said(program, tmp_path / "cache") == ["32.0", "32.0"]


PROGRAM = """
import numpy as np
from vmachining.notice import notice
from vmachining.jit import kernel
notice.compiling = lambda: print("compiling")

@kernel
def total(row):
    out = 0.0
    for value in row:
        out += value
    return out

print(total(np.arange(4.0)))
"""


def said(path, cache):
    """What the program prints with a directory for its cache."""
    environment = os.environ | {"NUMBA_CACHE_DIR": str(cache), "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run([sys.executable, path], env=environment, capture_output=True, text=True, check=True)
    return done.stdout.split()


def test_a_cache_that_is_damaged_or_cannot_be_is_as_good_as_none(tmp_path):
    program = tmp_path / "program.py"
    program.write_text(PROGRAM)
    assert said(program, tmp_path / "cache") == ["compiling", "6.0"]
    assert said(program, tmp_path / "cache") == ["6.0"]
    files = [file for file in (tmp_path / "cache").rglob("*") if file.is_file()]
    assert len(files) >= 2
    for garbage in (b"", b"not a pickle", bytes(200)):
        for file in files:
            file.write_bytes(garbage)
        assert said(program, tmp_path / "cache") == ["compiling", "6.0"]
    (tmp_path / "file").write_text("")
    assert said(program, tmp_path / "file" / "below") == ["compiling", "6.0"]


OUTER = """
import sys
import numpy as np
from vmachining.jit import kernel
from program import total
print("scipy.linalg" in sys.modules)

@kernel
def scaled(row):
    return 2.0 * total(row)

print(scaled(np.arange(4.0)))
"""


def test_a_start_from_the_cache_loads_machine_code_alone_and_can_still_compile(tmp_path):
    program, cache = tmp_path / "outer.py", tmp_path / "cache"
    (tmp_path / "program.py").write_text(PROGRAM)
    program.write_text(OUTER)
    assert said(program, cache) == ["compiling", "6.0", "True", "12.0"]
    assert said(program, cache) == ["6.0", "False", "12.0"]
    program.write_text(OUTER.replace("2.0", "3.0"))  # around a kernel of which only machine code is there
    assert said(program, cache) == ["6.0", "False", "compiling", "18.0"]


def test_what_a_kernel_imports_counts_for_its_cache(tmp_path, monkeypatch):
    """numba asks only whether the file of the kernel itself changed."""
    marks = []
    for limit in (1, 2):
        texts = {
            "vmachining.outer._kernels": "from vmachining.inner._kernels import held\n",
            "vmachining.inner._kernels": "from vmachining.inmost._kernels import (\n    LIMIT,\n)\n",
            "vmachining.inmost._kernels": f"LIMIT = {limit}\n",
        }
        for name, text in texts.items():
            module = ModuleType(name)
            module.__file__ = str(tmp_path / f"{name}.py")
            (tmp_path / f"{name}.py").write_text(text)
            monkeypatch.setitem(sys.modules, name, module)
        marks.append([imported(name) for name in texts])
        forget_sources()
    assert all(before != after for before, after in zip(*marks, strict=True))
