"""Removed volume of a block from B-rep booleans, accepted only inside a bracket somebody else proved.

Stateless: removed_k = ((S_0 and W_k) minus W_j minus ...), with only those earlier sweeps that reach what is
left. No damaged stock is inherited, blocks can be done in any order and in parallel.

A boolean of tangent solids may return anything, `isValid()` or not. So every value is compared with the bracket
of the block, widened by a stated slack, and on disagreement the next rung of `rungs.py` is climbed.

A bracket is wide, and a boolean that lost a small part may still lie in it. So rays are asked as well (`rays.py`), and the
next rung is climbed where they contradict a value by more than its own error: the slack of the gate is not part of that, in a
chip of 0.01 mm3 of a cutter that is deep in the stock it is a sixth, and plain cuts were 0.2 % off there. Near curved faces of a
STEP stock rays tell nothing. Beyond that a value is doubtful that is not the first one (two fuzzy ones were seen to agree on a
value that was 0.5 % low where all others gave 0), that is farther from the estimate of the mesh engine than estimates mostly are
(`DOUBT_REL`), or that a turning tool has a part in; none is in a bracket as tight as `TIGHT_REL`. More rays may bear it out.
Where they are too few for that, it is held against `facets` or `sections`, gives way to them if it is not within their error and
rays allow what they say, and is refused if neither can tell, nor more rays within `VAGUE_REL`. One that is doubtful for its
turning tool alone stands. `sure_mm3` says how far it may be off, also of a value without doubt where rays are too coarse to
tell an error of `TIGHT_REL`.

A value that no rung brings into the bracket is refused; the bracket stands. The last two rungs need no boolean of solids. They
come first where sweeps are unions of many solids (facets) and where helices wind over each other (sections): booleans
of those were seen to take more than 48 s, and to lose parts.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from functools import partial
from time import process_time
from typing import Any, TypeAlias

import numpy as np

from vmachining.engines.brep.blank import Blank
from vmachining.engines.brep.booleans import apart, box_of, common, is_empty, minus, turned
from vmachining.engines.brep.doubt import (
    SLACK_MM3,
    SURE_REL,
    TIGHT_REL,
    VAGUE_REL,
    Judged,
    clear_at,
    far_at_most,
    is_far,
    refuted_by,
)
from vmachining.engines.brep.faceted import Meshed, Taken, limit, taken, united
from vmachining.engines.brep.measure import volume
from vmachining.engines.brep.outside import Outside
from vmachining.engines.brep.rays import NOTHING, Heard, Rays
from vmachining.engines.brep.rungs import (
    FACETS,
    MESHES,
    NEXT,
    RAYS,
    RUNGS,
    SECTIONS,
    SOLIDS,
    STEADY,
    Clock,
    Found,
    Status,
    Verdict,
    steady_first,
)
from vmachining.engines.brep.sections import integrated, level_area
from vmachining.engines.brep.store import NOTHING_KEPT, Store
from vmachining.engines.brep.swept import solids
from vmachining.engines.brep.traits import GROWTH_MM, grown, is_helix, is_wound, levels, moved_area
from vmachining.errors import EngineError, SweepError
from vmachining.geometry import Bracket
from vmachining.sweep import Sweep, Turn
from vmachining.sweep.candidates import columns
from vmachining.sweep.near import SweepIndex
from vmachining.sweep.reach import meets, reaching

__all__ = ["Ladder", "quiet"]

SLACK_REL = 1e-6
"""Of the volume that stock and sweep share, or of the box both are in if a boolean claims to find more there:
what B-rep volumes are asked to be good to."""

STEADY_REL = 0.1
"""Of the width of the bracket: error asked of them. The value and its error must lie inside."""

HASTE = 0.6
"""Of the time that is left: what more rays may be expected to take."""

MANY = 4
"""Solids of sweeps that meet: with more, booleans take a minute."""

KEPT_SOLIDS, KEPT_TRIANGLES = 300, 2_000_000
"""Sweeps whose solids are remembered, and triangles of meshes, some 300 bytes each."""

Plans: TypeAlias = Sequence[tuple[int, list[int]]]
"""Sweeps of a block, each with the earlier ones that reach it."""


class Ladder:
    """The blocks of one program against one stock.

    Parameters
    ----------
    stock : Blank
    blocks : Sequence of sequences of Sweep
        What every block sweeps, in program order; an empty one removes nothing.
    store : Store
        Of solids, for this stock and these blocks.
    """

    def __init__(self, stock: Blank, blocks: Sequence[Sequence[Sweep]], store: Store = NOTHING_KEPT) -> None:
        self._blank = stock
        self._stock = stock.shape()
        self._box = box_of(self._stock)
        self._outside = Outside.of(stock)
        self._sweeps = [reaching(sweep, self._box) for block in blocks for sweep in block]
        self._first = np.cumsum([0, *(len(block) for block in blocks)])
        self._index = SweepIndex(self._sweeps)
        self._store = store
        self._made: dict[int, list[Any] | SweepError | EngineError] = {}
        self._held: dict[int, list[float]] = {}
        self._meshes: dict[tuple[int, float], Meshed] = {}
        self._known: set[tuple[int, float]] = set()

    def warm(self) -> None:
        """Compile what blocks will need, so that no block pays for it with its time."""
        middle, up = self._box.mean(axis=0, keepdims=True), (0.0, 0.0, 1.0)
        for sweep in {(type(sweep.path), is_helix(sweep)): sweep for sweep in self._sweeps}.values():
            sweep.signed_distance(sweep.bounds)
            sweep.ray_intervals(sweep.bounds.mean(axis=0, keepdims=True), up)
        if self._outside is not None:
            self._outside.ray_intervals(middle, up)

    def removed(
        self,
        block: int,
        bracket: Bracket,
        *,
        rungs: Sequence[str] = RUNGS,
        early: float = np.inf,
        longest: float = np.inf,
        seconds: float = np.inf,
        barred: Collection[str] = (),
        told: Callable[[str], None] = lambda rung: None,
    ) -> Verdict:
        """Removed volume of a block, gated by its bracket; `told` hears of every rung before it is tried.

        Before them it hears of `SOLIDS`, once for every sweep whose solids are not known yet. `FACETS` tells of `MESHES` in
        the same way, and of itself when it goes on. After a rung it hears of `RAYS`, if its value lies in the bracket, and of
        `NEXT` if another rung is tried.

        It agreed if the first of `RUNGS` worked, and was retried if any other one did. After `early` s of a
        processor, solids not counted, the steady ones come next: they take their time, but hardly fail. Those that are
        barred are not asked to confirm a value. `longest` and `seconds` are what rays, and all rungs, may take before whoever
        asks loses patience.
        """
        begin = process_time()
        tried: list[float | None] = []
        reason, refuted, count, slack = "", "", 0, 0.0
        seen = NOTHING
        members = range(int(self._first[block]), int(self._first[block + 1]))
        plans = [(k, self._index.needed(k, self._box)) for k in members if meets(self._sweeps[k], self._box)]
        try:
            for j in dict.fromkeys(j for k, earlier in plans for j in (k, *earlier)):
                if j not in self._made:
                    told(SOLIDS)
                    self._solids(j)
            left = self._ordered(plans, rungs)
        except (SweepError, EngineError) as exc:  # no rung builds what cannot be built
            return Verdict(Status.REFUSED, None, "", str(exc), process_time() - begin, 0)
        clock = Clock(told)
        rays = Rays(
            [(self._sweeps[k], [self._sweeps[j] for j in earlier]) for k, earlier in plans],
            self._blank,
            self._box,
            self._outside,
            block,
        )

        def heard(value: float, own: float, want: float = np.inf, sharp: float = np.inf) -> Heard:
            nonlocal seen
            if RAYS in barred:
                return NOTHING
            clock.tell(RAYS)
            spare = HASTE * min(longest, seconds - clock.own())
            seen = rays.heard(value, own, bracket, want, sharp, spare)
            return seen

        while left:
            late = [rung for rung in left if rung in STEADY and clock.own() > early]
            rung = left.pop(left.index(late[0]) if late else 0)
            if tried:
                clock.tell(NEXT)
            clock.tell(rung)
            try:
                if rung == SECTIONS:
                    found = self._sectioned(plans, bracket, STEADY_REL)
                elif rung == FACETS:
                    found = self._faceted(plans, bracket, STEADY_REL, told=clock.tell)
                else:
                    found = self._climb(plans, rung)
            except (SweepError, EngineError) as exc:  # halves and grown build solids of their own
                reason = str(exc)
                tried.append(None)
                continue
            except Exception as exc:  # OCCT raises whatever it meets, outside of booleans too
                reason = f"OCCT failed: {type(exc).__name__} {exc}"
                tried.append(None)
                continue
            _, value, count, slack, _ = found
            tried.append(value)
            if not bracket.holds(value, slack):
                reason = f"{value:.6g} mm3 is outside [{bracket.lo:.6g}, {bracket.hi:.6g}]"
                if not plans:
                    break
                continue
            judged = self._judged(plans, bracket, found, tried, heard, clock.tell, barred)
            if seen.alarm:  # no value can be told from another one where the judges exclude each other
                break
            if judged.right is None:
                if not judged.is_refuted:
                    reason = judged.why
                    break
                refuted = refuted or judged.why
                continue
            rung, value, count, slack, own = judged.right
            if rung in STEADY:
                reason = f"no boolean stands; {rung} of the solids say {value:.6g} +- {own:.2g} mm3"
                continue
            error = own + min(max(bracket.hi - value, value - bracket.lo), far_at_most(value, seen))
            status = Status.AGREED if rung == RUNGS[0] else Status.RETRIED
            spent = process_time() - begin
            return Verdict(
                status, max(value, 0.0), rung, "", spent, count, tuple(tried), slack, judged.sure, float(error),
                seen.interval,
            )  # fmt: skip
        heard(bracket.estimate, 0.0)
        if seen.alarm:
            return Verdict(
                Status.DISPUTED, None, "", seen.alarm, process_time() - begin, count, tuple(tried), slack,
                rays=seen.interval,
            )  # fmt: skip
        reason = "; ".join(filter(None, (refuted, reason)))
        return Verdict(
            Status.REFUSED,
            None,
            "",
            reason,
            process_time() - begin,
            count,
            tuple(tried),
            slack,
            rays=seen.interval,
        )

    def _judged(
        self,
        plans: Plans,
        bracket: Bracket,
        found: Found,
        tried: list[float | None],
        heard: Callable[..., Heard],
        told: Callable[[str], None],
        barred: Collection[str],
    ) -> Judged:
        """What rays say of a value in its bracket, and if it is in doubt and they tell too little, steady rungs.

        tried : values until now, with this one; what a steady rung finds instead, and rays allow, is put there, too.
        """
        rung, value, _, _, own = found
        room = max(bracket.hi - value, value - bracket.lo)
        is_tight = room <= TIGHT_REL * value  # proven, whatever made the value
        # the first ones may have cost another process
        is_weak = len(tried) > 1 or rung != RUNGS[0] or is_far(value, own, bracket)
        is_doubtful = rung not in STEADY and not is_tight and (is_weak or self._is_turning(plans))
        want = SURE_REL * (bracket.hi - bracket.lo) if is_doubtful else np.inf
        sharp = np.inf if is_tight else clear_at(value, own)
        seen = heard(value, own, want, sharp)
        if not seen.stands:
            return Judged(None, why=refuted_by(found, seen), is_refuted=True)
        if not is_doubtful or seen.far <= want:
            is_told = is_tight or (seen.is_clear and not is_doubtful)
            return Judged(found, None if is_told else far_at_most(value, seen))
        right, sure, why = self._confirmed(plans, bracket, found, heard, told, barred)
        # rays may still tell as much as would have been asked of steady rungs, and may have been asked more meanwhile
        vague = VAGUE_REL * (bracket.hi - bracket.lo)
        seen = heard(value, own, vague if right is None else np.inf, sharp)
        known = far_at_most(value, seen)
        if right is not None and right.rung != rung:  # judged by no fewer rays than the value
            tried.append(right.value)
            last = heard(right.value, right.own, sharp=clear_at(right.value, right.own))
            if not last.is_clear:  # what rays suspect, or would not see, is not as good as it says of itself
                sure = far_at_most(right.value, last)
            if not last.stands:
                why, right = refuted_by(right, last), None
        if right is None:
            if not seen.stands:
                return Judged(None, why=refuted_by(found, seen), is_refuted=True)
            if is_weak and known > vague:
                return Judged(None, why=f"{value:.6g} mm3 is doubtful and not confirmed: {why}")
            return Judged(found, known)
        if right.rung != rung:
            if is_weak or not seen.stands:
                return Judged(right, sure)
            sure += abs(value - right.value)  # neither is known to be better
        if not seen.stands:
            return Judged(None, why=refuted_by(found, seen), is_refuted=True)
        # booleans, meshes and sections are of the same solids: what rays would not see may be wrong in all of them
        is_alone = seen.far < np.inf and not seen.is_clear
        return Judged(found, known if is_alone else min(sure, known))

    def _is_turning(self, plans: Plans) -> bool:
        """Whether a sweep of the block, or one before it that reaches it, is that of a tool that leans or turns."""
        return any(isinstance(self._sweeps[j].path, Turn) for k, earlier in plans for j in (k, *earlier))

    def _ordered(self, plans: Plans, rungs: Sequence[str]) -> list[str]:
        """The rungs in the order they are tried."""
        wound = any(
            is_wound(self._sweeps[k]) and any(is_wound(self._sweeps[j]) for j in earlier)
            for k, earlier in plans
        )
        most = max((len(self._solids(j)) for k, earlier in plans for j in (k, *earlier)), default=0)
        if wound:  # few large sheets: sections are as good as meshes of them in half the time
            return steady_first(rungs, (SECTIONS, FACETS))
        return steady_first(rungs) if most > MANY else list(rungs)

    def _common_box(self, k: int) -> float:
        """mm^3 of the box in which a sweep and the stock can meet: no boolean vouches for this one."""
        lo, hi = self._sweeps[k].bounds
        return float(np.maximum(np.minimum(hi, self._box[1]) - np.maximum(lo, self._box[0]), 0.0).prod())

    def _climb(self, plans: Plans, rung: str) -> Found:
        """By booleans of solids."""
        total, count, slack, own = 0.0, 0, 0.0, SLACK_MM3
        for k, earlier in plans:
            if rung == "halves":
                one, two = self._sweeps[k].split([0.5])
                first = _solids(one)
                value, shared = self._cut(first, earlier, rung)
                rest, more = self._cut(_solids(two), earlier, rung, own=first)
                value, shared = value + rest, shared + more
            else:
                value, shared = self._cut(self._solids(k), earlier, rung)
            total += value
            count += len(earlier)
            slack += SLACK_REL * min(abs(shared), self._common_box(k))
            if rung == "grown":
                own += sum(GROWTH_MM * moved_area(self._sweeps[j]) for j in earlier)
        return Found(rung, total, count, slack + own, own)

    def _cut(
        self, parts: Sequence[Any], earlier: Sequence[int], rung: str, own: Sequence[Any] = ()
    ) -> tuple[float, float]:
        """(removed volume, volume shared by stock and sweep) by one way of doing it.

        parts : solids of the sweep. own : of another part of the block that comes before it.
        """
        fuzzy = float(rung.split()[1]) if rung.startswith("fuzzy") else 0.0
        is_grown = rung == "grown"
        tools = [_solids(grown(self._sweeps[j])) if is_grown else self._solids(j) for j in earlier]
        tools.insert(0, list(own))
        if rung == "reversed":
            tools.reverse()
        stock, cut = self._stock, [part for tool in tools for part in tool]
        if rung == "turned":
            stock, parts, cut = turned(stock), [turned(p) for p in parts], [turned(p) for p in cut]
        value = shared = 0.0
        for number, part in enumerate(parts):
            rest = part if rung == "late stock" else common(part, stock, fuzzy)
            shared += volume(rest)
            others = [*cut, *parts[:number]]
            if rung == "joint" and others:
                rest = minus(rest, others, fuzzy)
            else:
                for other in others:
                    if apart(rest, other):
                        continue
                    rest = minus(rest, [other], fuzzy)
                    if is_empty(rest):
                        break
            if rung == "late stock" and not is_empty(rest):
                rest = common(rest, stock, fuzzy)
            value += volume(rest)
        return value, shared

    def _sectioned(self, plans: Plans, bracket: Bracket, share_of_width: float) -> Found:
        """By level sections."""
        total = error = 0.0
        for k, earlier in plans:
            bounds = self._sweeps[k].bounds
            box = np.stack([np.maximum(bounds[0], self._box[0]), np.minimum(bounds[1], self._box[1])])
            # heights at which there is nothing make few others miss what there is
            found = columns(self._sweeps[k], [self._sweeps[j] for j in earlier], box, 1)
            ends = found.bottom, found.top
            if not ends[0] < ends[1]:
                continue
            parts = self._solids(k)
            others = [part for j in earlier for part in self._solids(j)]
            stops = [z for j in (k, *earlier) for z in levels(self._sweeps[j]) if ends[0] < z < ends[1]]
            share = share_of_width * (bracket.hi - bracket.lo) / len(plans)
            doubts = [0.0]
            level = partial(level_area, stock=self._stock, parts=parts, others=others, box=box)
            value, miss = integrated(partial(_noted, level, doubts), [*ends, *stops], share)
            total, error = total + value, error + miss + max(doubts) * (ends[1] - ends[0])
        error += SLACK_REL * abs(total)  # outlines of a plain slot were seen to be 1e-7 off
        return Found(
            SECTIONS, float(total), sum(len(earlier) for _, earlier in plans), -float(error), float(error)
        )

    def _faceted(
        self,
        plans: Plans,
        bracket: Bracket,
        share_of_width: float,
        told: Callable[[str], None],
    ) -> Found:
        """By meshes."""

        def removed(sag: float) -> list[Taken]:
            if (-1, sag) not in self._meshes:
                self._keep(-1, sag, united([self._stock], [volume(self._stock)], sag, self._box))
            stock = self._meshes[-1, sag]
            return [
                taken(stock, self._mesh(k, sag, told), (self._mesh(j, sag, told) for j in earlier))
                for k, earlier in plans
            ]

        value, error = limit(removed, share_of_width * (bracket.hi - bracket.lo))
        return Found(FACETS, value, sum(len(earlier) for _, earlier in plans), -error, error)

    def _confirmed(
        self,
        plans: Plans,
        bracket: Bracket,
        found: Found,
        heard: Callable[..., Heard],
        told: Callable[[str], None],
        barred: Collection[str],
    ) -> tuple[Found | None, float, str]:
        """(who is right, within how much, why nobody): what is found, if the first steady rung that can tell agrees with
        it, else what that one says if rays allow it."""
        why = []
        width = bracket.hi - bracket.lo
        helical = any(is_helix(self._sweeps[j]) for k, earlier in plans for j in (k, *earlier))
        for rung in STEADY[::-1] if helical else STEADY:  # OCCT's meshes of their sheets may take minutes
            if rung in barred:
                why.append(f"{rung}: not asked again after a process was lost")
                continue
            ask = partial(self._faceted, told=told) if rung == FACETS else self._sectioned
            told(rung)
            try:
                other = ask(plans, bracket, SURE_REL)
            except Exception as exc:  # OCCT raises whatever it meets
                why.append(f"{rung}: {exc}")
                continue
            error = other.own
            if error <= VAGUE_REL * width + SLACK_MM3:
                if bracket.holds(other.value, error) and abs(found.value - other.value) <= found.own + error:
                    return found, abs(found.value - other.value) + error, ""
                if bracket.holds(other.value, -error):
                    seen = heard(other.value, error, sharp=clear_at(other.value, error))
                    if seen.stands:
                        return other, error, ""
                    why.append(refuted_by(other, seen))
                    continue
            why.append(f"{rung}: {other.value:.6g} +- {error:.2g} mm3 does not tell")
        return None, np.inf, "; ".join(why)

    def _mesh(self, k: int, sag: float, told: Callable[[str], None]) -> Meshed:
        """Of a sweep, in the box of the stock, remembered."""
        if (k, sag) not in self._meshes:
            is_new = (k, sag) not in self._known
            if is_new:  # one that was forgotten since counts for the block
                told(MESHES)
            mesh = self._store.mesh(k, sag, lambda: united(self._solids(k), self._volumes(k), sag, self._box))
            if is_new:
                told(FACETS)
                self._known.add((k, sag))
            self._keep(k, sag, mesh)
        return self._meshes[k, sag]

    def _keep(self, k: int, sag: float, mesh: Meshed) -> None:
        total = sum(int(known.solid.num_tri()) for known in self._meshes.values())
        while self._meshes and total > KEPT_TRIANGLES:
            total -= int(self._meshes.pop(next(iter(self._meshes))).solid.num_tri())
        self._meshes[k, sag] = mesh

    def _solids(self, k: int) -> list[Any]:
        """Solids of a sweep, the latest few hundred remembered: booleans leave them as they are."""
        if k not in self._made:
            if len(self._made) > KEPT_SOLIDS:
                self._made.pop(next(iter(self._made)))
            try:
                self._made[k] = self._store.solids(k, partial(_solids, self._sweeps[k]))
            except (SweepError, EngineError) as exc:
                self._made[k] = exc
        found = self._made[k]
        if isinstance(found, (SweepError, EngineError)):
            raise found
        return found

    def _volumes(self, k: int) -> list[float]:
        """Of the solids of a sweep, mm^3."""
        if k not in self._held:
            self._held[k] = [volume(shape) for shape in self._solids(k)]
        return self._held[k]


def _noted(level: Callable[[float], tuple[float, float]], doubts: list[float], z: float) -> float:
    """The area at a height; its doubt goes into a list."""
    value, doubt = level(z)
    doubts.append(doubt)
    return value


def _solids(sweep: Sweep) -> list[Any]:
    return [part.shape for part in solids(sweep)]


def quiet() -> None:
    """OCCT keeps its messages to itself."""
    from OCP.Message import Message

    Message.DefaultMessenger_s().ChangePrinters().Clear()
