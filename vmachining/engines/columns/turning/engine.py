"""`AnyDirection`: what one sweep removes after others, by columns in any direction."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vmachining.arrays import Bools, Floats, Ints
from vmachining.engines.columns.roof._kernels import Roof
from vmachining.engines.columns.turning.air import Left
from vmachining.engines.columns.turning.blocks._kernels import Grown, nothing_yet, remove
from vmachining.engines.columns.turning.cells._kernels import WAYS
from vmachining.engines.columns.turning.rows import Rows, meridian
from vmachining.engines.columns.turning.stocks import Solid, solid_of
from vmachining.engines.columns.turning.triangles._kernels import UPRIGHT, room
from vmachining.engines.protocol import NOTHING, Options, Removal
from vmachining.stock import Stock
from vmachining.sweep import Sweep

CELLS, FIRST = 6000, 2400
"""Of a row at most, and along the direction by rule of a ball."""

BRIEF, TRIAL, LONGER = 50, 200, 400
"""Cells after which `SOME` directions continue, after which two do, and after which one does."""

SOME = 4
"""Directions. Of flat bottoms all continue after `BRIEF`, and one after `TRIAL`: there, those that fall fastest begin widest."""

HOPE = 24.0
"""Requested widths that a ball may be away after these cells to continue alone: twice what is made good where width falls with
the number of cells."""

SNAP = np.cos(np.radians(12.0))
"""A direction as near as this to the normal of a face of the stock stands upright on it: the face is then no slope."""

STILL_MM = 1e-6
"""Way of a tip that stands still."""

SAME = 1.0 - 1e-12
"""Cosine of directions that are one, as two are that snap to one face of the stock."""

NO_SIDE = 0.1
"""Part of a feed across the axis below which the tool plunges or stands still: any side will do, else all directions are one."""

HALF = len(WAYS)
UVT = np.array([0, 1, HALF - 5])
"""Which of the kernel's directions are the axes of its frame."""

UP = np.array([0.0, 0.0, 1.0])

SLACK_MM, ULPS = 1e-9, 4096
"""Rounding of heights: a least, and in units in the last place of the extent (about 1e-12 of it)."""

CONTRADICTION = "columns along two directions contradict each other"
"""Note of a bracket that no proof bears: all directions are proofs of one number, so that they must meet."""


class Scene(NamedTuple):
    """One row and what meets it along one direction, see `remove` of blocks/_kernels.py."""

    rows: Floats
    waves: Floats
    reach: Floats
    faces: Floats
    roof: Roof
    starts: Ints
    root: Floats
    slack: float
    grown: Grown


class AnyDirection:
    """A stock; it keeps no sweeps."""

    rules = 15
    """Bits of the rules in force, see cells/_kernels.py."""

    def __init__(self, solid: Solid, width: float, width_mm3: float) -> None:
        self.solid, self.width, self.width_mm3 = solid, width, width_mm3
        self._room = room()
        self._seen: Scene | None = None

    @classmethod
    def of(cls, stock: Stock, options: Options) -> AnyDirection:
        """That of a job.

        Raises
        ------
        StockError
            It is not a stock of `solid_of`.
        """
        return cls(solid_of(stock), options.width, options.width_mm3)

    @staticmethod
    def takes(sweep: Sweep) -> bool:
        """Whether the cutter is known: ball, bull, flat and cones, and unions of such."""
        return all(meridian(piece) is not None for piece in sweep.profile.convex_pieces())

    def meets(self, sweep: Sweep) -> bool:
        """Whether the box of a sweep meets that of the stock."""
        low, high = sweep.bounds
        return bool(
            (low < self.solid.corners.max(axis=0)).all() and (high > self.solid.corners.min(axis=0)).all()
        )

    def cut(
        self, own: Rows, before: Rows | None, floor: float = 0.0, left: Sequence[Left] | None = None
    ) -> Removal:
        """What a sweep removes after others.

        own : of the sweep, in the order in which its parts come. before : of all that may meet it. floor : mm^3 of width that
        is enough. left : of `Air.left`; then `before` needs no sweeps but those of `Air.around`.
        """
        rows = own if before is None else Rows.join([own, before])
        wanted = max(self.width_mm3, floor)
        found, most = NOTHING, max(300, CELLS // len(own))
        for k in range(len(own)):
            order = np.array([k, *range(k), *range(len(own), len(rows))], dtype=np.int64)
            if left is None or len(left[k].cubes):
                found = found.plus(
                    self._one(rows, order, wanted / len(own), most, None if left is None else left[k])
                )
        return found

    def _one(self, rows: Rows, order: Ints, floor: float, most: int, left: Left | None) -> Removal:
        """Of row order[0] after the others."""
        k = int(order[0])
        if rows.as_one(k)[order[1:]].any():
            return NOTHING
        origin = rows.ends[k, :, :3].mean(axis=0)
        lo, hi, full, said = 0.0, np.inf, False, list[tuple[float, float]]()
        begins, ends = (rows.with_pose(k, end)[order] for end in (0, 1))
        shared = np.array([begins, ends])
        ways = self._directions(rows, k, not begins[1:].any())
        scenes, widths = dict[int, Scene](), dict[tuple[int, int], float]()

        def enough(numbers: Sequence[int], cells: int) -> bool:
            """Look along some directions until the bracket is narrow."""
            nonlocal lo, hi, full
            for number in numbers:
                if (number, cells) not in widths:
                    scene = scenes.get(number)
                    if scene is None:
                        scene = self._scene(rows, order, shared, frame_of(ways[number]), origin, most, left)
                    if scene is None:  # nothing of it is in the stock
                        a, b, made = 0.0, 0.0, 0
                    else:
                        scenes[number] = scene
                        a, b, made = self._look(scene, floor, min(cells, most))
                    said.append((a, b))
                    lo, hi, full = max(lo, a), min(hi, b), made >= most
                    widths[number, cells] = b - a
                if hi - lo <= max(floor, self.width * 0.5 * (lo + hi)):
                    return True
            return False

        # of a ball the direction by rule is asked alone at first; of others, and where that is not enough, all are compared
        asked = list(range(len(ways)))
        done, ball, flat = False, rows.cutter[k, 0] == 0.0, rows.cutter[k, 2] == 0.0
        if ball:
            done = enough(asked[:1], BRIEF) or enough(asked[:1], TRIAL)
            if not done and hi - lo <= HOPE * max(floor, self.width * 0.5 * (lo + hi)):
                done = enough(asked[:1], FIRST)
        if not done and not enough(asked, BRIEF):
            steps = [(BRIEF, TRIAL, 1)]
            if not flat:
                asked = sorted(asked, key=lambda number: widths[number, BRIEF])[:SOME]
                steps = [(BRIEF, TRIAL, 2), (TRIAL, LONGER, 1)]
            for before, cells, keep in steps:
                if enough(asked, cells):
                    break
                # those that will be the narrowest if they fall as they did
                asked = sorted(asked, key=lambda n: widths[n, cells] ** 2 / widths[n, before])[:keep]
            else:
                enough(asked, most)
        lo, hi = float(lo), float(hi)
        if lo > hi:
            least, most_of_all = min(a for a, _ in said), max(b for _, b in said)
            return Removal(least, 0.5 * (lo + hi), most_of_all, False, note=CONTRADICTION)
        if hi == 0.0:
            return NOTHING
        note = (
            f"{most} columns in any direction were not enough"
            if full
            else "room for columns in any direction was used up"
        )
        return Removal(lo, 0.5 * (lo + hi), hi, note=note)

    def _directions(self, rows: Rows, k: int, begins: bool = False) -> list[Floats]:
        """First along the axis, or back from it where the back of the tool cuts nothing, the farther the more the tip moves
        aside; then along the axis and both diagonals between it and the sides; of tapered balls, whose flank cuts most where they
        are slender, also along both diagonals across the axis. (Of 25 random blocks of balls and cones that
        start where others end, none but pivots was narrower by a fifth along another one.)

        begins : no sweep before has the first pose.
        """
        axis = rows.ends[k, :, 3:].sum(axis=0)
        axis /= np.linalg.norm(axis)
        feed = rows.ends[k, 1, :3] - rows.ends[k, 0, :3]
        aside = feed - (feed @ axis) * axis
        aside /= max(float(np.linalg.norm(feed)), STILL_MM)
        first, still = (axis if begins else axis - aside), np.linalg.norm(aside) < NO_SIDE
        if still:
            aside = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
            aside /= np.linalg.norm(aside)
        side = np.cross(axis, aside)
        wanted = (first, axis - aside if begins or still else axis)
        out, faces = list[Floats](), np.concatenate([self.solid.faces[:, :3], UP[None]])
        across = (aside + side, aside - side) if rows.cutter[k, 0] == 0.0 < rows.cutter[k, 3] else ()
        for d in (*wanted, axis + side, axis - side, *across):
            n = d / np.linalg.norm(d)
            near = int(np.argmax(faces @ n))
            way = faces[near] if faces[near] @ n >= SNAP else n
            if self.solid.stands(way) and not any(way @ other > SAME for other in out):
                out.append(way)
        return out or [UP]

    def _scene(
        self,
        rows: Rows,
        order: Ints,
        shared: Bools,
        frame: Floats,
        origin: Floats,
        limit: int,
        left: Left | None,
    ) -> Scene | None:
        """What the kernel gets for one direction; None where no column meets the sweep and the stock.

        shared : (2, n) which rows of the order have the first, and the last pose. left : of row order[0].
        """
        ways = WAYS @ frame
        there = ways @ origin
        reach = rows.reach(ways) - np.concatenate([there, -there])
        stock, own = (self.solid.corners - origin) @ frame.T, reach[order[0]]
        high, low = np.minimum(own[UVT], stock.max(axis=0)), np.maximum(-own[UVT + HALF], stock.min(axis=0))
        raised = 0.0
        faces = self.solid.faces
        if left is not None:
            faces = self.solid.within(*left.box)
            corners = (left.corners - origin) @ frame.T
            high, least = np.minimum(high, corners.max(axis=0)), np.maximum(low, corners.min(axis=0))
            low, raised = least, float(least[2] > low[2])
        if (high <= low).any():
            return None
        size, middle = high - low, 0.5 * (low + high)
        half = min(max(0.5 * min(size[:2]), max(size[:2]) / 12.0), 0.25 * max(size[:2]))
        count = np.ceil(size[:2] / (2.0 * half))
        low[:2], high[:2] = middle[:2] - half * count, middle[:2] + half * count
        root = np.array([*low[:2], half, *count, low[2], high[2], raised])
        # no plane stands between a sweep and what row order[0] has in the stock
        box = WAYS
        box = np.concatenate([box, -box])
        most = np.minimum(own, np.maximum(box * low, box * high).sum(axis=1))
        extent = float(np.abs([*low, *high]).max() + np.abs(origin).max() + rows.cutter[:, 6].max())
        slack = max(SLACK_MM, ULPS * float(np.finfo(float).eps) * extent)
        near = (reach[order] + slack > -np.roll(most, HALF)).all(axis=1)
        if not near[0]:  # it passes a corner of the stock
            return None
        some = rows.take(order[near])
        seen, waves = some.seen_from(frame, origin)
        starts = np.array([which[near][1:].any() for which in shared], dtype=np.int64)
        faces = np.column_stack([faces[:, :3] @ frame.T, faces[:, 3] - faces[:, :3] @ origin])
        roof = self.solid.roof(frame, origin, root)
        grown = nothing_yet(limit, int(root[3] * root[4]), len(some))
        faces = np.ascontiguousarray(faces)
        return Scene(seen, waves, reach[order[near]] + slack, faces, roof, starts, root, slack, grown)

    def _look(self, scene: Scene, floor: float, cells: int) -> tuple[float, float, int]:
        """(lo, hi, cells) along one direction, after those that it has been asked about before; R10: planes and covers keep off
        by the slack, and sums are rounded as well."""
        root, grown = scene.root, scene.grown
        if self._seen is not scene:  # witnesses are kept by numbers of rows
            self._room.K.fill(-1)
            self._seen = scene
        remove(
            scene.rows, scene.waves, scene.reach, scene.faces, scene.roof, scene.starts, self.rules, self._room, root,
            len(scene.rows) // 2, self.width, floor, cells, scene.slack, grown,
        )  # fmt: skip
        lo, hi = grown.sums.tolist()
        error = 4.0 * scene.slack * float(root[2] ** 2 * root[3] * root[4])
        # faces that all but stand along the columns are taken as if they did
        lean = np.abs(scene.faces[:, 2])
        aside = float(lean[lean < UPRIGHT].sum() * np.abs(root[5:7]).max())
        error += aside * float(np.hypot(*(2.0 * root[2] * root[3:5])) * (root[6] - root[5]))
        return max(lo - error, 0.0), hi + error, int(grown.at[2])


def frame_of(direction: Floats) -> Floats:
    """(3, 3) rows u, v, t."""
    t = direction / np.linalg.norm(direction)
    u = np.eye(3)[np.argmin(np.abs(t))]
    u = u - (u @ t) * t
    u /= np.linalg.norm(u)
    return np.array([u, np.cross(t, u), t])
