"""`[[tools]]` tables."""

import pytest

from vmachining.errors import ToolError
from vmachining.tool import AptTool, BallNose, BullNose, FlatEnd, ProfileTool, Taper, tool_from_mapping


def test_every_type():
    common = {"number": 1, "length_mm": 60, "flute_length_mm": 30, "flutes": 3, "helix_deg": 35}
    cases = {
        FlatEnd: {"type": "flat", "diameter_mm": 10},
        BallNose: {"type": "ball", "diameter_mm": 10},
        BullNose: {"type": "bull", "diameter_mm": 10, "corner_radius_mm": 2},
        Taper: {"type": "taper", "diameter_mm": 4, "taper_deg": 5, "corner_radius_mm": 2},
        AptTool: {
            "type": "apt",
            "apt": {"d": 20, "r": 5, "e": 5, "f": 5, "alpha_deg": 0, "beta_deg": 0, "h": 60},
        },
        ProfileTool: {"type": "profile", "profile": [[0, 0], [5, 0], [10, 5], [10, 60]]},
    }
    for kind, own in cases.items():
        tool = tool_from_mapping(common | own)
        assert type(tool) is kind
        assert tool.length == 60
        assert tool.flute_length == 30
        assert tool.flutes == 3
        assert tool.helix_deg == 35


def test_inches_scale_lengths_and_nothing_else():
    table = {"type": "taper", "diameter_mm": 0.5, "taper_deg": 7, "length_mm": 2, "shank_diameter_mm": 0.5,
             "flute_length_mm": 1, "holder": [[1, 2], [1, 3]]}  # fmt: skip
    tool = tool_from_mapping(table, scale=25.4)
    assert isinstance(tool, Taper)
    assert tool.diameter == 12.7
    assert tool.length == 50.8
    assert tool.taper_deg == 7
    assert tool.shank_diameter == 12.7
    assert tool.holder == ((25.4, 50.8), (25.4, 3 * 25.4))
    apt = {"d": 1, "r": 0.25, "e": 0.25, "f": 0.25, "alpha_deg": 0, "beta_deg": 3, "h": 2}
    with pytest.raises(ToolError):
        tool_from_mapping({"type": "apt", "apt": apt | {"r": 3}}, scale=25.4)
    sharp = tool_from_mapping({"type": "apt", "apt": apt | {"r": 0, "e": 0, "f": 0}}, scale=25.4)
    assert sharp.profile.points[0].tolist() == [12.7, 0]
    assert sharp.length == 50.8


def test_apt_and_profile_need_no_length():
    assert tool_from_mapping({"type": "profile", "profile": [[0, 0], [5, 5]]}).length == 5


FLAT = {"number": 7, "type": "flat", "diameter_mm": 10, "length_mm": 50}


@pytest.mark.parametrize(
    ("table", "word", "text"),
    [
        ({"number": 7}, "type", "type is missing"),
        ({"number": 7, "type": "reamer"}, "type", "one of flat, ball"),
        ({"number": 7, "type": "flat", "length_mm": 5}, "diameter_mm", "missing"),
        ({"number": 7, "type": "flat", "diameter_mm": 5}, "length_mm", "missing"),
        (FLAT | {"corner_radius_mm": 1}, "corner_radius_mm", "does not belong to type 'flat'"),
        (FLAT | {"diamter_mm": 1}, "diamter_mm", "did you mean diameter_mm"),
        (FLAT | {"diameter_mm": "10"}, "diameter_mm", "'10' is not a number"),
        (FLAT | {"diameter_mm": True}, "diameter_mm", "not a number"),
        (FLAT | {"diameter_mm": -3}, "diameter_mm", "above zero"),
        (FLAT | {"flutes": 2.5}, "flutes", "not a whole number"),
        (FLAT | {"flute_length_mm": 60}, "flute_length_mm", "longer than length"),
        (FLAT | {"holder": [[1, 2, 3]]}, "holder", "rows"),
        (FLAT | {"holder": [[1, 60], [2, 55]]}, "holder", "falls"),
        ({"number": 7, "type": "apt"}, "apt", "add apt"),
        ({"number": 7, "type": "apt", "apt": {"d": 20}}, "r", "missing"),
        ({"number": 7, "type": "apt", "apt": {"D": 20}}, "D", "no parameter D"),
        ({"number": 7, "type": "profile"}, "profile", "rows"),
        ({"number": 7, "type": "profile", "profile": [[0, 1], [5, 5]]}, "profile", "tip is z = 0"),
        (FLAT | {"type": "bull", "corner_radius_mm": 6}, "corner_radius_mm", "half the diameter"),
    ],
)
def test_refusals_name_tool_and_key(table, word, text):
    with pytest.raises(ToolError, match="tool 7") as caught:
        tool_from_mapping(table)
    assert caught.value.word == word
    assert text in str(caught.value)
