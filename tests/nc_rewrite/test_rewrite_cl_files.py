"""New feeds in cutter location files, read back: only those asked for differ."""

from __future__ import annotations

import pytest

from vmachining.nc import BlockEdit, parse_program, rewrite_feeds

HEAD = "UNITS/MM\nLOADTL/1\nSPINDL/1000,CLW\nRAPID\nGOTO/0,0,10\nFEDRAT/100\nGOTO/10,0,0\n"
BODIES = {
    "cycle": "CYCLE/DRILL,RAPTO,2,FEDTO,-5,MMPM,50\nGOTO/10,0,0\nGOTO/20,0,0\nCYCLE/OFF\nGOTO/30,0,5\nGOTO/40,0,5\n",
    "continued": "CYCLE/TAP,RAPTO,2,$\nFEDTO,-5,PERREV,.1\nGOTO/10,0,0\nCYCLE/OFF\nGOTO/30,0,5\n",
    "feed of the file": "CYCLE/DRILL,RAPTO,2,FEDTO,-5\nGOTO/10,0,0\nGOTO/20,0,0\nCYCLE/OFF\nGOTO/30,0,5\n",
    "arc": "INDIRV/0,1,0\nTLON,GOFWD/(CIRCLE/0,0,0,10),ON,(LINE/0,0,0,0,10,0)\nGOTO/5,0,0\n",
    "unit": "UNITS/INCHES\nGOTO/1,1,0\nGOTO/2,0,0\nFEDRAT/10\nGOTO/3,0,0\n",
    "unit per turn": "FEDRAT/.1,PERREV\nGOTO/20,0,0\nUNITS/INCHES\nGOTO/1,1,0\nGOTO/2,0,0\n",
}


@pytest.mark.parametrize("what", BODIES)
def test_feeds_in_a_cl_file_read_back(what):
    text = HEAD + BODIES[what] + "END\n"
    program = parse_program(text.encode(), "a.cls", dialect="apt")
    assert not program.errors
    for line in sorted({m.line for m in program.moves if m.feed_mm_min is not None}):
        found = rewrite_feeds(program, {line: BlockEdit(line, (37.0,), (1.0,))})
        again = parse_program(found.data, "a.cls", dialect="apt")
        wanted = [
            37.0 if m.line == line and m.feed_mm_min and not found.untouched else m.feed_mm_min or 0.0
            for m in program.moves
        ]
        got = [m.feed_mm_min or 0.0 for m in again.moves]
        assert got == pytest.approx(wanted, rel=1e-3), (line, found.data.decode())
        in_cycle = line in {"cycle": (9, 10), "continued": (10,)}.get(what, ())
        assert (found.untouched == (line,)) == in_cycle
        assert [m.end for m in again.moves] == [m.end for m in program.moves]
