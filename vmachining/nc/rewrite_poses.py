"""New feeds into a table of poses: cells of `feed_mm_min`, every other byte as it was.

An empty cell keeps what the row before had, so a row after a changed one gets the feed it had, where that was left out. Rows
are not divided. A table without the column, and lines with quotes, are left alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from vmachining.nc.rewrite_pieces import Written, number_text

FEED = "feed_mm_min"


def rewrite_pose_feeds(lines: Sequence[tuple[str, str]], feeds: Mapping[int, float]) -> Written:
    """Write feeds into a table.

    lines : text and end of every line, from the first.
    feeds : mm/min by 1-based line, as they are to be written.
    """
    out: list[str] = []
    untouched: list[int] = []
    column, width = -1, 0
    was: str | None = None
    now: float | None = None
    header = True
    for k, (text, end) in enumerate(lines, 1):
        row = text.strip()
        if not row or row.startswith("#"):
            out.append(text + end)
            continue
        cells = text.split(",")
        if header:
            names = [cell.strip().lower() for cell in cells]
            column, width, header = (names.index(FEED) if FEED in names else -1), len(names), False
            out.append(text + end)
            continue
        if column < 0 or '"' in text or len(cells) != width:
            if k in feeds:
                untouched.append(k)
            out.append(text + end)
            continue
        cell = cells[column].strip()
        was = cell or was
        old = float(was) if was else None
        want = feeds.get(k, old)
        have = float(cell) if cell else (now if now is not None else old)
        if want is not None and want != have:
            number = number_text(want, 1) if k in feeds and want != old else (was or "")
            cells[column] = cells[column].replace(cell, number, 1) if cell else cells[column] + number
            text = ",".join(cells)
        now = want
        out.append(text + end)
    return Written(out, tuple(untouched))
