"""Compiled functions: what borrows arrays may not make any."""

from __future__ import annotations

import numba
import numpy as np
import pytest

from vmachining.jit import kernel, leaf


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
