"""`vmachining machine`: chain, class and limits of presets and files, as text, JSON and a page with pictures."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from vmachining.cli.main import run
from vmachining.machine import PRESETS

PAGE = (Path(__file__).parents[2] / "docs" / "kinematics.md").read_text()
HEXAPOD = re.search(r"```toml\n(name = \"example hexapod\".*?)```", PAGE, re.DOTALL)[1]

CLASSES = {
    "2/0": (
        "ac-table",
        "bc-table",
        "ba-table",
        "ab-table",
        "nutating-table",
        "xyzac-trt",
        "xyzbc-trt",
        "2/0",
    ),
    "1/1": ("c-table-b-head", "c-table-a-head", "1/1"),
    "0/2": ("ac", "bc", "ab", "hexa", "ca-head", "cb-head", "ab-head", "ba-head", "nutating-head", "0/2"),
    "0/0": ("xyz",),
}


def shown(capsys, *args):
    assert run(["machine", *args]) == 0
    return capsys.readouterr().out


def test_every_preset_has_the_class_of_its_name(capsys):
    assert sorted(name for names in CLASSES.values() for name in names) == sorted(PRESETS)
    rows = [line.split() for line in shown(capsys).splitlines()]
    found = {row[0]: row[2] for row in rows}
    assert found == {name: kind for kind, names in CLASSES.items() for name in names}


def test_a_preset_with_travels(capsys, tmp_path):
    told = json.loads(shown(capsys, "xyzac-trt", "--json"))
    assert told["configuration"] == "C'A'|XYZ" and told["class"] == "2/0"
    a = told["axes"][1]
    assert (a["min"], a["max"]) == pytest.approx((-100.0, 50.0)) and a["max_speed_min"] == pytest.approx(
        1800.0
    )
    assert a["point_mm"] == [0.0, 20.0, 10.0] and told["options"]["y_offset_mm"] == 20.0
    out = tmp_path / "m.html"
    text = shown(capsys, "xyzac-trt", "--out", str(out))
    assert "A turns about (1, 0, 0) through (0, 20, 10) mm" in text
    page = out.read_text()
    boxes = re.findall(r'font-weight="600">([^<]+)</text>', page)
    assert boxes == ["workpiece", "C&#x27;", "A&#x27;", "bed", "X", "Y", "Z", "tool"]
    assert page.count("<svg") == 2 and "-100 to 50 deg" in page


def test_a_file_with_legs(capsys, tmp_path):
    (tmp_path / "hexapod.toml").write_text(HEXAPOD)
    out = tmp_path / "h.html"
    shown(capsys, str(tmp_path / "hexapod.toml"), "--out", str(out))
    told = json.loads(shown(capsys, str(tmp_path / "hexapod.toml"), "--json"))
    assert told["class"] == "hexapod" and told["limits"]["max_feed_mm_min"] == 10000
    # joint 1 of the example: from (850, -150, 1100) to (180, -240, 250)
    assert told["legs"]["home_mm"][0] == pytest.approx((670**2 + 90**2 + 850**2) ** 0.5, rel=1e-12)
    upright, leaning = ([v or 0.0 for v in told["legs"]["radius_mm"][tilt]] for tilt in ("0", "30"))
    assert max(upright) > max(leaning) > 0
    assert "Reach of the legs" in out.read_text()


def test_no_such_machine(capsys):
    assert run(["machine", "xyzac"]) == 2
    assert "did you mean xyzac-trt" in capsys.readouterr().err
