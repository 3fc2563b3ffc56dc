"""The sample part of one CAM system, posted for several controls: the same part has the same path, whoever reads it.

Ends of feed motions that follow each other in both programs, in runs of at least four, are counted. Posts round inches to
1e-4 (2.5 um) and millimetres to 1e-3, so ends count as one within 0.05 mm; programs differ in operations, and in pecks.
"""

from __future__ import annotations

import difflib
from pathlib import Path

import pytest

from vmachining.nc import read_program

POSTS = Path(__file__).resolve().parents[3] / "shared/data/posts"
STEP_MM = 0.05

GROUPS = [
    # two posts for Sinumerik: cavity of 233 blocks, and contours
    (
        "sinumerik/0235_Cincinnati_Lamb_FTV5_840D_sample.ptp",
        "sinumerik/0246_DMU_70_eVo_840D_in_Sample_part.ptp",
        280,
    ),
    # Sinumerik in inch and Fanuc
    ("sinumerik/0235_Cincinnati_Lamb_FTV5_840D_sample.ptp", "fanuc-macro/0255_Haas_5T.ptp", 90),
    ("sinumerik/0246_DMU_70_eVo_840D_in_Sample_part.ptp", "fanuc-like-iso/0268_MS_NMV_sample_mm.ptp", 120),
    # conversational in inch, DIN/ISO in mm: contours, drilling, pecking
    ("heidenhain/0238_DMC_70V_sample_in.ptp", "fanuc-like-iso/0292_sample_output.txt", 800),
    ("heidenhain/0238_DMC_70V_sample_in.ptp", "fanuc-like-iso/0316_sample_IN.ptp", 800),
    # one part from posts for Makino, Mazak, Mitsubishi, Makino A-axis and Toyoda mills
    ("fanuc-like-iso/0316_sample_IN.ptp", "fanuc-like-iso/0286_4_axis_mill.ptp", 1870),
    ("fanuc-macro/0298_Mitsubishi_VR33_Rhead_output.txt", "fanuc-like-iso/0286_4_axis_mill.ptp", 1870),
    ("fanuc-like-iso/0228_sample.ptp", "fanuc-like-iso/0286_4_axis_mill.ptp", 810),
    ("fanuc-like-iso/0321_Toyoda_sample_part.ptp", "fanuc-like-iso/0316_sample_IN.ptp", 410),
    ("heidenhain/0238_DMC_70V_sample_in.ptp", "fanuc-macro/0298_Mitsubishi_VR33_Rhead_output.txt", 850),
    # a boring mill whose W stands beside Z, and a mill without it
    ("fanuc-like-iso/0265_Sample_Kuraki_KBT.ptp", "fanuc-like-iso/0310_MS_NMV_sample_output.txt", 150),
    ("fanuc-like-iso/0289_Gcode_output.txt", "fanuc-like-iso/0292_sample_output.txt", 1600),
    # one turned part: diameters and radius words; radii and exchanged arcs; radii and reversed centres, twice
    ("okuma/0314_Okuma_lb15w.ptp", "fanuc-like-iso/0284_testpart.ptp", 250),
    ("okuma/0314_Okuma_lb15w.ptp", "fanuc-like-iso/0262_test_part.ptp", 250),
    ("okuma/0314_Okuma_lb15w.ptp", "fanuc-like-iso/0243_Daewoo_Puma_sample.ptp", 100),
]


def ends(name: str) -> list[tuple]:
    program = read_program(POSTS / name, dialect="auto", rotary="ABC", home=(0.0, 0.0, 100.0))
    return [(m.motion, *(round(v / STEP_MM) for v in m.end)) for m in program.moves if m.feed_mm_min]


@pytest.mark.skipif(not POSTS.is_dir(), reason="programs of others are not here")
@pytest.mark.parametrize(("one", "two", "least"), GROUPS)
def test_one_part_in_two_dialects_has_one_path(one: str, two: str, least: int):
    pieces = difflib.SequenceMatcher(None, ends(one), ends(two), autojunk=False).get_matching_blocks()
    assert sum(piece.size for piece in pieces if piece.size >= 4) >= least
