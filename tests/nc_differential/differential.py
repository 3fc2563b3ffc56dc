"""Random programs through this reader and through the stand-alone interpreter of LinuxCNC (a development tool).

    python tests/nc_differential/differential.py --rs274 ./rs274 [--count 300] [--seed 0] [FEATURE ...]

`rs274` is in Debian's package linuxcnc-uspace; set LD_LIBRARY_PATH to its libraries. Features: arcs, cycles,
offsets, rotation, tools, modes, flow, polar, compensation. One line per feature: programs, motions compared, refused by both,
differences. The first differing programs are printed. Exit code 1 if there is a difference.

Left out on purpose, because they are documented departures or errors of the reference: R that falls below a
higher level in a series of cycles; near reversals under compensation; a rotation that changes while G92 is in
force (it forgets to turn that offset); units that change while a tool length is in force; units and work
offsets that change in a series of cycles; break and continue in repeat; do loops that run again or beside while
loops (it takes their end for a while); the value of a subprogram before it was called; sizes of a tool (#5401
to #5410) in mm, which it says in inches; pecks without depth, which its rounding adds to holes of whole steps;
a tool change behind changed offsets without a motion between. Under compensation this reader refuses more: the
reference does not test entry moves and arcs for running backwards. It refuses a few arcs behind a corner that
it has passed over and that are read here; both are counted apart.
"""

from __future__ import annotations

import argparse
import math
import random
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

from vmachining.nc import Motion, Move, ToolEntry, move_record, parse_program

CALL = re.compile(r"N\.*\d*\s+(\w+)\((.*)\)")
TABLE = "T1 P1 Z0.5 D0.25;\nT2 P2 Z0.7 D0.5;\n"
TOOLS = {1: ToolEntry(1, 6.35, 12.7), 2: ToolEntry(2, 12.7, 17.78)}
PRINTED_MM = 0.6e-4 * 25.4
"""The reference prints four decimals, in inches at worst."""

OFFSET_MM = 2e-3
"""Compensated points of the reference differ by this much where its corners are nearly tangent."""

Call = tuple[str, list[float]]


def number(rng: random.Random, low: float, high: float) -> str:
    return f"{rng.uniform(low, high):.3f}".rstrip("0").rstrip(".")


def words(rng: random.Random, letters: str, low: float = -20, high: float = 20, keep: float = 0.6) -> str:
    return " ".join(letter + number(rng, low, high) for letter in letters if rng.random() < keep)


def arcs(rng: random.Random) -> list[str]:
    lines, point = [f"G2{rng.randrange(2)} G17 F100 S100 M3", "G0 X0 Y0 Z0"], [0.0, 0.0, 0.0]
    plane, ends, middle = 17, (0, 1, 2), "IJ"
    for _ in range(12):
        if rng.random() < 0.2:
            plane = rng.choice((17, 18, 19))
            ends, middle = {17: ((0, 1, 2), "IJ"), 18: ((2, 0, 1), "KI"), 19: ((1, 2, 0), "JK")}[plane]
            lines.append(f"G{plane}")
        if rng.random() < 0.2:
            lines.append(rng.choice(("G1", "G0")) + " X1 " + words(rng, "YZ"))
            lines.append("G1 " + " ".join(f"{a}{v:.4f}" for a, v in zip("XYZ", point, strict=True)))
            continue
        radius, begin, sweep = rng.uniform(1, 20), rng.uniform(0, 6.28), rng.uniform(0.3, 5.9)
        ccw = rng.random() < 0.5
        center = [point[ends[0]] - radius * math.cos(begin), point[ends[1]] - radius * math.sin(begin)]
        finish = begin + (sweep if ccw else -sweep)
        target = list(point)
        target[ends[0]] = round(center[0] + radius * math.cos(finish), 5)
        target[ends[1]] = round(center[1] + radius * math.sin(finish), 5)
        if rng.random() < 0.4:
            target[ends[2]] = round(point[ends[2]] + rng.uniform(-3, 3), 3)
        head = f"G{3 if ccw else 2} " + " ".join(f"{a}{v:.5f}" for a, v in zip("XYZ", target, strict=True))
        if rng.random() < 0.4:
            head += f" R{radius if sweep < math.pi else -radius:.5f}"
        else:
            head += "".join(f" {w}{c - point[e]:.5f}" for w, c, e in zip(middle, center, ends, strict=False))
            head += rng.choice(("", "", " P1", " P2"))
        lines.append(head)
        point = target
    return lines


def cycles(rng: random.Random) -> list[str]:
    plane = rng.choice((17, 18, 19))
    across, along = {17: ("XY", "Z"), 18: ("ZX", "Y"), 19: ("YZ", "X")}[plane]
    out = [f"G{plane} G2{rng.randrange(2)} G90 S100 M3 F80", f"G0 {along}{number(rng, -5, 30)}"]
    for _ in range(rng.randrange(1, 4)):
        code = rng.choice([73, 81, 82, 83, 84, 85, 86, 89])
        out += [
            rng.choice(("G80", "G80", "G80 G0", "G1 G80")),
            f"G9{rng.randrange(8, 10)} G90",
            f"G0 {along}{number(rng, -5, 30)}",
        ]
        depth, level = rng.uniform(-20, 0), rng.uniform(1, 9)
        extra = {73: " Q", 83: " Q"}.get(code, "")
        extra += number(rng, 1, 9) if extra else ""
        extra += f" P{rng.randrange(3)}" if code in (82, 86, 89) else ""
        if rng.random() < 0.5:
            out.append(f"G{code} {words(rng, across, keep=1)} R{level:.3f} {along}{depth:.3f}{extra}")
        else:
            out += ["G91", f"G{code} {words(rng, across, keep=1)} R{rng.uniform(-5, 5):.3f}"]
            out[-1] += f" {along}{depth:.3f}{extra} L{rng.randrange(1, 4)}"
        out += [words(rng, across, keep=1) for _ in range(rng.randrange(3))]
    return out


def offsets(rng: random.Random, turning: bool = False) -> list[str]:
    out = [f"G2{rng.randrange(2)} F100 S100 M3", "G0 X1 Y2 Z3"]
    choices: list[Callable[[], str]] = [
        lambda: "G0 " + words(rng, "XYZ"),
        lambda: "G1 " + words(rng, "XYZA"),
        lambda: "G10 L2 P" + str(rng.randrange(0, 10)) + " " + words(rng, "XYZ"),
        lambda: "G10 L20 P" + str(rng.randrange(0, 4)) + " " + words(rng, "XYZ"),
        lambda: rng.choice(("G49", "G43 H1", "G43 H2", "G43.1 Z5")),
        lambda: rng.choice(("G54", "G55", "G56", "G59.1", "G90", "G91", "G90", "G28.1", "G30.1")),
        lambda: "G90 G53 G0 " + words(rng, "XY", keep=1),
        lambda: "G28 X1" if rng.random() < 0.5 else "G30",
        lambda: f"G3 X{number(rng, 1, 9)} Y{number(rng, 1, 9)} R50",
    ]
    if turning:
        choices.append(lambda: f"G10 L2 P{rng.randrange(0, 4)} R{rng.randrange(-90, 90)}")
    else:
        choices.append(lambda: "G92 X1 " + words(rng, "YZ"))
        choices.append(lambda: "G52 X1 " + words(rng, "YZ"))
        choices.append(lambda: rng.choice(("G92.1", "G92.2", "G92.3")))
    return out + [rng.choice(choices)() for _ in range(25)]


def tools(rng: random.Random) -> list[str]:
    """Tool offsets written by G10, and seen by G43 and the parameters of the tool."""
    out = ["G20 F100 S100 M3", "G0 X1 Y2 Z3", "T1 M6"]
    if rng.random() < 0.4:
        out.append("G10 L2 P1 X2 Y3 Z4 R" + str(rng.randrange(-90, 90)))
    elif rng.random() < 0.5:
        out.append("G92 X1 Y-2 Z3")
    out.append("G10 L2 P9 X1 Y2 Z-3 R" + rng.choice(("0", "30")))
    choices: list[Callable[[], str]] = [
        lambda: "G0 " + words(rng, "XYZ"),
        lambda: f"G10 L1 P{rng.randrange(1, 3)} Z1 " + words(rng, "XY", keep=0.5) + rng.choice(("", " R2")),
        lambda: f"G10 L10 P{rng.randrange(1, 3)} Z2 " + words(rng, "XY", keep=0.5),
        lambda: f"G10 L11 P{rng.randrange(1, 3)} Z3 " + words(rng, "XY", keep=0.5),
        lambda: rng.choice(("G43", "G43 H1", "G43 H2", "G49", "G43.2 H1")),
        lambda: "G0 X#5401 Y#5402 Z#5403",
        lambda: "G0 X#5410 Y#5400",
        lambda: "G49\nG0 X0 Y0 Z9\nT2 M6",
    ]
    return out + [rng.choice(choices)() for _ in range(20)]


def modes(rng: random.Random) -> list[str]:
    """Modes saved and brought back by M70 to M73. Units are left: the reference converts its level."""
    choices: list[Callable[[], str]] = [
        lambda: f"G{rng.randrange(2)} X{rng.randrange(9)} Y{rng.randrange(9)} Z{rng.randrange(1, 9)}",
        lambda: rng.choice(("G90", "G91", "G80\nG54", "G80\nG55", "G80\nG56", "F200", "G98", "G99")),
        lambda: rng.choice(("M70", "M70", "G80\nM72", "M71", "M73")),
        lambda: "G98 G81 X3 Y4 Z-1 R0.5",
        lambda: "G80",
    ]
    inner = [rng.choice(choices)() for _ in range(8)]
    inner = [line for line in inner if "M7" not in line]  # one level is enough: M72 may find nothing saved
    out = ["o<s> sub", rng.choice(("M73", "")), *inner, "o<s> endsub"]
    out += ["G21 G98 F100 S100 M3", "G10 L2 P2 X1 Y2", "G10 L2 P3 Z3", "G0 X0 Y0 Z5", "M70"]
    for _ in range(12):
        out.append(rng.choice(choices)() if rng.random() < 0.8 else "G80\no<s> call\nG80")
    return out


def rotation(rng: random.Random) -> list[str]:
    return offsets(rng, turning=True)


def polar(rng: random.Random) -> list[str]:
    out = ["G21 F100 S100 M3", "G0 X5 Y2 Z3"]
    for _ in range(15):
        head = rng.choice(("G0", "G1", "G90 G1", "G91 G0", "G17 G1", "G90 G0 Z1"))
        out.append(f"{head} {words(rng, '@^', 1, 60) or '@9'}")
    return out


def flow(rng: random.Random) -> list[str]:
    labels = iter(range(100, 10_000))
    left_out = rng.choice((4, 6))  # while or do

    def body(depth: int, kinds: int = 7) -> list[str]:
        """kinds: 7 everything, 6 what may run again, 5 the same without calls."""
        out = []
        for _ in range(rng.randrange(1, 4)):
            kind = rng.randrange(kinds if depth else 2)
            if kind == left_out:
                kind = 3
            label = next(labels)
            inner = body(depth - 1, min(kinds, 6)) if depth else []
            if kind == 0:
                out.append(f"G91 G0 X[#{rng.randrange(1, 6)} + {rng.randrange(9)}] Y1")
            elif kind == 1:
                out.append(f"#{rng.randrange(1, 6)} = [[#{rng.randrange(1, 6)} + {rng.randrange(9)}] MOD 7]")
            elif kind == 2:
                out += [f"o{label} if [#{rng.randrange(1, 6)} LT {rng.randrange(7)}]", *inner]
                if rng.random() < 0.5:
                    out += [f"o{label} elseif [#1 GT {rng.randrange(7)}]", *body(0)]
                out += [f"o{label} else", *body(0), f"o{label} endif"]
            elif kind == 3:
                out += [f"o{label} repeat [{rng.randrange(4)}]", *inner]
                out.append(f"o{label} endrepeat")
            elif kind == 4:
                counter = f"#{label + 1000}"
                out += [f"{counter} = 0", f"o{label} while [{counter} LT {rng.randrange(4)}]"]
                out += [f"{counter} = [{counter} + 1]", *inner]
                if rng.random() < 0.4:
                    out += [f"o{label + 5000} if [#2 GT 3]", f"o{label} {rng.choice(('break', 'continue'))}"]
                    out += [f"o{label + 5000} endif", *body(0)]
                out.append(f"o{label} endwhile")
            elif kind == 6:
                counter = f"#{label + 1000}"
                out += [f"{counter} = 0", f"o{label} do", f"{counter} = [{counter} + 1]", *body(0)]
                out.append(f"o{label} while [{counter} LT {rng.randrange(4)}]")
            else:
                out.append(f"o<s{rng.randrange(2)}> call [{rng.randrange(5)}] [#{rng.randrange(1, 4)}]")
        return out

    subs = []
    for k in range(2):
        subs += [f"o<s{k}> sub", "G91 G0 X#1 Y#2", *body(2, 5)]
        subs += [f"o<s{k}> endsub [#1 + 1]"]
    tail = [
        "o<s0> call [1] [2]",
        "G90 G0 X#<_value>",
        "M98 P900 L2",
        "M2",
        "O900",
        "G91 G0 Z1",
        *body(1, 5),
        "M99",
    ]
    return ["G21", *subs, *body(3), *(tail if rng.random() < 0.5 else [])]


def compensation(rng: random.Random) -> list[str]:
    """Rapids, lines and arcs whose corners turn by up to 3 rad; below 0.05 rad the reference passes over them."""
    side = rng.choice((41, 42))
    out = ["G21 G90 F100 S100 M3", "G0 X0 Y0 Z0", f"G{side}.1 D{rng.choice((2, 4, 6))}"]
    x, y, heading = 0.0, 0.0, rng.uniform(0, 6.28)
    for k in range(rng.randrange(3, 9)):
        turn = rng.uniform(0.1, 2.9) if rng.random() < 0.7 else rng.choice((0.0, rng.uniform(0.0, 0.048)))
        heading += rng.choice((-1, 1)) * turn if k else 0.0
        if k and rng.random() < 0.4:
            radius, sweep, ccw = rng.uniform(2, 15), rng.uniform(0.4, 4), rng.random() < 0.5
            turn = 1 if ccw else -1
            cx, cy = x - turn * radius * math.sin(heading), y + turn * radius * math.cos(heading)
            heading += turn * sweep
            ex, ey = cx + turn * radius * math.sin(heading), cy - turn * radius * math.cos(heading)
            out.append(f"G{3 if ccw else 2} X{ex:.6f} Y{ey:.6f} I{cx - x:.6f} J{cy - y:.6f}")
        else:
            length = rng.uniform(8, 30)
            ex, ey = x + length * math.cos(heading), y + length * math.sin(heading)
            out.append(f"G{rng.choice((0, 1, 1))} X{ex:.6f} Y{ey:.6f}" + rng.choice(("", "", " Z1", " Z0")))
        x, y = ex, ey
        if rng.random() < 0.2:
            out.append(f"G1 Z{rng.randrange(3)}")
    return [*out, f"G40 G1 X{x + 30 * math.cos(heading):.6f} Y{y + 30 * math.sin(heading):.6f}"]


FEATURES: dict[str, Callable[[random.Random], list[str]]] = {
    "arcs": arcs, "cycles": cycles, "offsets": offsets, "rotation": rotation, "tools": tools, "modes": modes,
    "polar": polar, "flow": flow, "compensation": compensation,
}  # fmt: skip


def reference(command: str, text: str, folder: Path) -> tuple[list[Call], bool]:
    """Calls of the reference interpreter in mm, and whether it refused the program."""
    for name in ("v", "v.bak"):
        (folder / name).unlink(missing_ok=True)
    (folder / "p.ngc").write_text(text)
    (folder / "t.tbl").write_text(TABLE)
    for _ in range(3):  # two of them at once may crash: they share a file
        done = subprocess.run(
            ["timeout", "-k", "1", "20", command, "-t", "t.tbl", "-v", "v", "-g", "p.ngc"],
            cwd=folder, capture_output=True, text=True, errors="replace", check=False,
        )  # fmt: skip
        if done.returncode >= 0:
            break
    calls: list[Call] = []
    unit, ended = 1.0, False
    for name, raw in CALL.findall(done.stdout):
        if name == "USE_LENGTH_UNITS":
            unit = 25.4 if "INCH" in raw else 1.0
        ended |= name == "PROGRAM_END"
        values = (
            [float(v) for v in raw.split(",")]
            if name in ("STRAIGHT_TRAVERSE", "STRAIGHT_FEED", "ARC_FEED")
            else []
        )
        if name == "ARC_FEED":
            calls.append((name, [v if i == 4 else unit * v for i, v in enumerate(values[:6])]))
        elif values:
            calls.append((name, [unit * v for v in values[:3]] + [values[3]]))
    return calls, not ended


def ours(move: Move) -> Call:
    end = list(move.end_program)
    angle = (move.rotary_program or {}).get("a", 0.0)
    if move.motion is Motion.RAPID:
        return "STRAIGHT_TRAVERSE", [*end, angle]
    if move.center is None:
        return "STRAIGHT_FEED", [*end, angle]
    a, b, c = {"xy": (0, 1, 2), "zx": (2, 0, 1), "yz": (1, 2, 0)}[move.plane]
    turns = move.turns if move.motion is Motion.ARC_CCW else -move.turns
    return "ARC_FEED", [end[a], end[b], *move_record(move, "program")["center_mm"], turns, end[c]]


def differs(mine: list[Call], theirs: list[Call], limit: float) -> str | None:
    for k, ((kind, values), (wanted, numbers)) in enumerate(zip(mine, theirs, strict=False)):
        if kind != wanted or max(abs(a - b) for a, b in zip(values, numbers, strict=True)) > limit:
            return f"motion {k}: {kind} {values}, wanted {wanted} {numbers}"
    return f"{len(mine)} motions, wanted {len(theirs)}" if len(mine) != len(theirs) else None


def compare(feature: str, command: str, count: int, seed: int, folder: Path) -> int:
    """Prints one line; returns the number of differences."""
    motions = refused = stricter = laxer = differences = 0
    for k in range(count):
        rng = random.Random(f"{feature} {seed} {k}")
        lines = FEATURES[feature](rng)
        text = "\n".join([*lines, "" if "M2" in lines else "M2", ""])
        theirs, bad = reference(command, text, folder)
        program = parse_program(
            text.encode(),
            "p",
            home=(0.0, 0.0, 0.0),
            tools=TOOLS,
            rotary="ABC",
            work_offsets={"G54": (0.0, 0.0, 0.0)},
        )
        errors = [f for f in program.errors if f.code != "W401"]
        mine = [ours(m) for m in program.moves if m.motion is not Motion.DWELL]
        problem = None
        if bad or errors:
            refused += bad and bool(errors)
            if feature == "compensation" and errors and errors[0].code == "E355":
                stricter += not bad
            elif feature == "compensation" and not errors:
                laxer += 1
            elif bad != bool(errors):
                problem = f"refused here: {errors[:1]}, there: {bad}"
            elif feature != "compensation":
                mine = mine[: len(theirs)]
                problem = differs(mine, theirs, PRINTED_MM)
        else:
            problem = differs(mine, theirs, OFFSET_MM if feature == "compensation" else PRINTED_MM)
        motions += len(theirs)
        if problem:
            differences += 1
            if differences <= 3:
                print(f"--- {feature} {k}: {problem}\n{text}", file=sys.stderr)
    print(
        f"{feature}: {count} programs, {motions} motions, {refused} refused by both, "
        f"{stricter} as gouges here only, {laxer} there only, {differences} differ"
    )
    return differences


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("features", nargs="*", metavar="FEATURE", help=", ".join(FEATURES))
    parser.add_argument("--rs274", required=True)
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        found = [
            compare(name, given.rs274, given.count, given.seed, Path(folder))
            for name in given.features or FEATURES
        ]
    return 1 if any(found) else 0


if __name__ == "__main__":
    sys.exit(main())
