"""Machine files: the same machine as its preset, and a message with file and line for every mistake."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from machines import joints

from vmachining.errors import KinematicsError
from vmachining.machine import load, preset
from vmachining.machine.machinefile import machine_from_mapping

GOOD = """\
name = "trunnion"
gauge_mm = [0, 0, 50]
tool_length_mm = 50

[work]
origin_mm = [1, 2, 3]
rotation_deg = [0, 0, 90]

[[axes]]
name = "C"
kind = "rotary"
carries = "work"
direction = "z"
sign = -1
max_speed_deg_min = 3600

[[axes]]
name = "A"
kind = "rotary"
carries = "work"
direction = [1, 0, 0]
point_mm = [0, 0, -50]
sign = -1
min_deg = -120
max_deg = 30
max_acceleration_deg_s2 = 500

[[axes]]
name = "x"
kind = "linear"
carries = "tool"
direction = "x"
min_mm = -200
max_mm = 200
max_speed_mm_min = 12000

[[axes]]
name = "Y"
kind = "linear"
carries = "tool"
direction = "y"

[[axes]]
name = "Z"
kind = "linear"
carries = "tool"
direction = "z"
"""


@pytest.fixture
def write(tmp_path):
    def to_file(text):
        path = tmp_path / "machine.toml"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return to_file


def test_a_file_is_its_preset(write):
    m = load(str(write(GOOD)))
    want = preset("ac-table", second_point=(0, 0, -50)).with_work(
        (1, 2, 3), [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    )
    q = joints(m, np.random.default_rng(1), 50)
    np.testing.assert_allclose(m.forward(q).tip, want.forward(q).tip, atol=1e-12)
    np.testing.assert_allclose(m.forward(q).axis, want.forward(q).axis, atol=1e-15)
    assert m.name == "trunnion" and m.names == ("C", "A", "X", "Y", "Z") and m.chain == "C'A'|XYZ"
    np.testing.assert_allclose(np.degrees(m.limits[:, 1]), (-120, 30))
    assert m.limits[:, 2].tolist() == [-200, 200] and np.isinf(m.limits[:, 3]).all()
    assert m.axes[2].max_speed == 200.0 and m.axes[0].max_speed == pytest.approx(np.radians(60))
    assert m.axes[1].max_acceleration == pytest.approx(np.radians(500))


def test_the_example_of_the_docstring_is_right():
    from vmachining.machine import machinefile

    text = machinefile.__doc__.split("\n\n", 1)[1]
    assert machine_from_mapping(tomllib.loads(text)).names == ("C",)


@pytest.mark.parametrize(
    ("old", "new", "where", "message"),
    [
        ('kind = "rotary"', 'kind = "rotry"', 11, "give linear or rotary"),
        ("max_speed_deg_min", "max_sped_deg_min", 15, "did you mean max_speed_deg_min"),
        ("max_speed_mm_min", "max_speed_deg_min", 35, "did you mean"),
        ('direction = "x"', 'direction = "u"', 32, "give x, y, z"),
        ("direction = [1, 0, 0]", "direction = [0, 0, 0]", 21, "no length"),
        ("direction = [1, 0, 0]", "direction = [1, 0]", 21, "three finite numbers"),
        ("sign = -1\nmax", "sign = 2\nmax", 14, "sign is"),
        ('carries = "tool"\ndirection = "z"', 'carries = "work"\ndirection = "z"', 46, "comes after one"),
        ('carries = "tool"\ndirection = "z"', 'carries = "bed"\ndirection = "z"', 46, "give work or tool"),
        ("min_mm = -200", "min_mm = 300", 33, "is empty"),
        ("min_mm = -200", "min_mm = true", 33, "expected a number"),
        ("min_mm = -200", "min_mm = inf", 33, "leave it out"),
        ("min_mm = -200", "point_mm = [0, 0, 0]", 33, "has no point_mm"),
        ('name = "x"', 'name = "A"', None, "given twice"),
        ('name = "x"', "name = 1", 29, "give a letter"),
        ("gauge_mm", "guage_mm", 2, "did you mean gauge_mm"),
        ("origin_mm", "orign_mm", 6, "did you mean origin_mm"),
        ("rotation_deg = [0, 0, 90]", "rotation_deg = 90", 7, "three finite numbers"),
        ("tool_length_mm = 50", "tool_axis = [0, 0, 0]", 3, "no direction"),
        ("tool_length_mm = 50", "tool_length_mm = [", 5, "not valid TOML"),
    ],
)
def test_mistakes_are_named(write, old, new, where, message):
    assert old in GOOD
    path = write(GOOD.replace(old, new, 1))
    with pytest.raises(KinematicsError) as caught:
        load(path)
    assert message in str(caught.value)
    assert caught.value.file == str(path) and caught.value.line == where


def test_files_that_are_none(write, tmp_path):
    with pytest.raises(KinematicsError, match="cannot read"):
        load(tmp_path / "none.toml")
    with pytest.raises(KinematicsError, match="UTF-8"):
        load(write("name = 'ü'".encode("utf-16")))
    with pytest.raises(KinematicsError, match=r"no \[\[axes\]\]"):
        load(write(""))
    with pytest.raises(KinematicsError, match="did you mean ac-table"):
        load("ac-tabel")
    with pytest.raises(KinematicsError, match="has no option 'pivot'"):
        load("ac-table", pivot=3)
    with pytest.raises(KinematicsError, match="options belong to presets"):
        load(write(GOOD), pivot=3)


@given(st.data())
@settings(deadline=None, max_examples=120)
def test_damaged_files_are_refused_or_read(data):
    """Lines dropped, doubled and replaced: a machine, or the one error that names it."""
    lines = GOOD.splitlines()
    for _ in range(data.draw(st.integers(1, 4))):
        k = data.draw(st.integers(0, len(lines) - 1))
        what = data.draw(st.sampled_from(["drop", "double", "value", "text"]))
        if what == "drop" and len(lines) > 1:
            del lines[k]
        elif what == "double":
            lines.insert(k, lines[k])
        elif what == "value" and "=" in lines[k]:
            value = data.draw(st.sampled_from(
                ["0", "-1", "1e999", "nan", "inf", "true", '""', '"x"', "[]", "[0, 0, 0]", "[1, 2]", "{}", "[[1]]",
                 "1979-05-27", '[1, "a", 3]', "99999999999999999999999"]
            ))  # fmt: skip
            lines[k] = lines[k].split("=")[0] + "= " + value
        else:
            lines[k] = data.draw(st.text(max_size=12))
    try:
        found = machine_from_mapping(tomllib.loads("\n".join(lines)))
    except (KinematicsError, tomllib.TOMLDecodeError):
        return
    assert np.isfinite(found.forward(np.zeros(len(found.axes))).axis).all()
