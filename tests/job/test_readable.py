"""Numbers of a CSV file: no digits that are rounding, none less than the number has."""

import csv

import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tinyjob import PROGRAM, write_job

from vmachining.job import Job, run
from vmachining.job.table import COLUMNS, readable


def through(values):
    return readable(pl.LazyFrame({"a": values}, schema={"a": pl.Float64})).collect()["a"].to_list()


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.10200000000000001, "0.102"),
        (0.1 + 0.2, "0.3"),
        (-2.5, "-2.5"),
        (0.0, "0.0"),
        (-0.0, "0.0"),
        (3e20, "3e+20"),
    ],
)
def test_a_decimal_is_written_as_it_was(value, text):
    assert repr(through([value])[0]) == text


def test_what_is_no_number_stays():
    first, second, third = through([None, float("inf"), float("nan")])
    assert first is None and second == float("inf") and third != third


@given(st.floats(-1e15, 1e15))
def test_nothing_that_matters_is_lost(value):
    (written,) = through([value])
    assert abs(written - value) <= 5e-15 * abs(value)


@given(st.integers(-(10**9), 10**9), st.integers(0, 6))
def test_a_short_decimal_plus_rounding_is_short_again(digits, places):
    exact = digits / 10**places
    for noisy in (exact * (1 + 2.0**-52), exact * (1 - 2.0**-53)):
        assert through([noisy]) == [exact]


def test_coordinates_of_a_program_in_inches(tmp_path):
    """25.4 times a decimal of three places has four."""
    program = PROGRAM.replace("N60 G1 X14 F600", "N60 G20\nG1 X0.551 F24.013\nG21")
    run(Job.load(write_job(tmp_path, program=program)), out=tmp_path / "o").write(
        tmp_path / "o", report=False
    )
    with (tmp_path / "o/blocks.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert rows[2]["x_mm"] == "13.9954" and rows[2]["feed_mm_min"] == "609.9302"
    assert all(
        len(row[name].lstrip("-0.").replace(".", "")) <= 15
        for row in rows
        for name in COLUMNS
        if "_m" in name
    )
