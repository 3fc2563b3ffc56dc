"""Reads a rewritten program back and compares what it does with what was wanted."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from vmachining.geometry import Line
from vmachining.nc import Move, Program, parse_program
from vmachining.nc.rewrite import BlockEdit, Rewritten, rewrite_feeds
from vmachining.nc.rewrite_pieces import move_path

ON_PATH_MM = 1e-4
"""Largest distance of an inserted point from the original path."""


def path(move: Move):
    """Path of any motion, rapids as lines."""
    return move_path(move) or Line(move.start, move.end)


def read(text: str | bytes, **options) -> Program:
    data = text.encode() if isinstance(text, str) else text
    program = parse_program(data, "test.nc", **options)
    program.require_clean(allow={"W401"})
    return program


def rewrite(text: str | bytes, feeds: Mapping[int, tuple], **options) -> tuple[Program, Rewritten]:
    """feeds: line -> (feed, ...) or ((feed, ...), (end, ...))."""
    program = read(text, **options)
    edits = {}
    for line, what in feeds.items():
        if isinstance(what[0], tuple):
            edits[line] = BlockEdit(line, *what)
        else:
            edits[line] = BlockEdit(line, what, tuple((k + 1) / len(what) for k in range(len(what))))
    return check(program, edits, **options)


def check(program: Program, edits: Mapping[int, BlockEdit], **options) -> tuple[Program, Rewritten]:
    """The written program drives the same path, with the wanted feeds, and the old ones elsewhere."""
    written = rewrite_feeds(program, edits)
    again = read(written.data, **options)
    assert len(written.source_line) == written.data.replace(b"\r\n", b"\n").replace(b"\r", b"\n").count(
        b"\n"
    ) + (not written.data.endswith((b"\n", b"\r")))
    old, new = _by_line(program.moves, None), _by_line(again.moves, written.source_line)
    assert old.keys() == new.keys()
    for line, moves in old.items():
        parts = new[line]
        assert {m.motion for m in parts} == {m.motion for m in moves}
        if len(moves) > 1 or moves[0].motion == "dwell":
            wanted = moves
            if line in edits and line not in written.untouched:  # a compensated block with its corner arc
                feed = min(edits[line].feeds_mm_min)
                wanted = [m if m.feed_mm_min is None else m._replace(feed_mm_min=feed) for m in moves]
            assert [m[2:] for m in parts] == [m[2:] for m in wanted]
            continue
        whole = path(moves[0])
        np.testing.assert_allclose(parts[-1].end, moves[0].end, atol=1e-9)
        np.testing.assert_allclose(parts[-1].end_program, moves[0].end_program, atol=1e-9)
        lengths = np.array([path(part).length for part in parts])
        assert abs(lengths.sum() - whole.length) <= 1e-6 * max(whole.length, 1.0)
        reached = np.cumsum(lengths)
        for part, at in zip(parts, reached, strict=True):
            want = whole.position(min(at / whole.length, 1.0)) if whole.length else whole.start
            assert np.abs(np.array(part.end) - want).max() <= ON_PATH_MM
            if whole.length:
                middle = whole.position((at - path(part).length / 2) / whole.length)
                assert np.abs(path(part).position(0.5) - middle).max() <= ON_PATH_MM
            assert part.spindle_rpm == moves[0].spindle_rpm or part.motion == "rapid" or len(parts) > 1
        _check_feeds(line, moves[0], parts, reached, edits.get(line), written)
    total = [sum(path(m).length for m in p.moves) for p in (program, again)]
    assert abs(total[0] - total[1]) <= 1e-6 * max(total[0], 1.0)
    return again, written


def _check_feeds(line, move, parts, reached, edit, written) -> None:
    if move.feed_mm_min is None:
        assert all(part.feed_mm_min is None for part in parts)
        return
    for part, at in zip(parts, reached, strict=True):
        if edit is None or line in written.untouched:
            np.testing.assert_allclose(part.feed_mm_min, move.feed_mm_min, rtol=1e-7, atol=1e-6)
            continue
        if line in written.unsplit or len(edit.ends) == 1:
            want = min(edit.feeds_mm_min)
        else:
            k = int(np.searchsorted(edit.ends, (at - path(part).length / 2) / max(reached[-1], 1e-9)))
            want = edit.feeds_mm_min[k]
        # the largest rounding is 0.1 mm/min; the length of a piece in inverse time is rounded too
        assert want - 0.101 - 1e-5 * want <= part.feed_mm_min <= want * (1 + 1e-5)


def _by_line(moves, source) -> dict[int, list[Move]]:
    out: dict[int, list[Move]] = {}
    for move in moves:
        out.setdefault(move.line if source is None else source[move.line - 1], []).append(move)
    return out
