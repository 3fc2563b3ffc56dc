"""How fast programs are read, how much memory a million lines take, and whether rubbish breaks the reader."""

from __future__ import annotations

import json
import math
import os
import random
from collections import Counter
from collections.abc import Iterator
from resource import RUSAGE_SELF, getrusage
from time import perf_counter, process_time
from typing import Any, Final

from vmachining.errors import NCError
from vmachining.nc import CATALOGUE, Program, ToolEntry, move_record, parse_program

__all__ = ["nc", "nc_fuzz"]

FUZZ_VARIABLE: Final = "VMACHINING_FUZZ_INPUTS"
FIRST_VARIABLE: Final = "VMACHINING_FUZZ_FIRST"
SLOWEST_S: Final = 1.0
"""Processor time; a single input of at most a few hundred characters that takes longer counts as a hang."""

TOOLS: Final = {k: ToolEntry(k, 2.0 * k, 50.0) for k in range(1, 5)}

SEEDS: Final = {
    "iso": [
        "%\nO100\nN10 G21 G90 G17 (setup)\nN20 T1 M6\nN30 S1000 M3\nG0 X0 Y0 Z5\nG1 Z-1 F100\nG2 X10 Y0 I5 J0\n"
        "G3 X0 R5 P1\nG91 X-1.5 Y+.25\nG28 Z1\nM30\n%\n",
        "G20 G98 F10 S9 M3\nG0 Z2\nG81 X1 Y1 Z-1 R1\nX2 L2\nG83 X3 Z-2 R.5 Q.3\nG82 X4 Z-1 R1 P.5\nG73 X5 Q.2 Z-1 R1\nG80\n"
        "G18 G85 X1 Z2 Y-1 R1\nM2\n",
        "G21 F100 S1 M3\nG10 L2 P1 X1 Y2 R30\nG54 G0 X1\nG92 X5\nG52 Y1\nG43 H1\nG1 @10 ^45\nG92.1\nG49 G53 G0 Z3\nM2\n",
        "F100 S1 M3\nG41 D2 G1 X20\nY20\nG2 X30 Y30 I10\nG3 X40 Y40 R10\nZ2\nX60\nG40 Y80\nM30\n",
        "#1=3 #<a>=[2*#1]\no1 sub\nG1 X#1 F[#2+1]\no1 return [#1*2]\no1 endsub\no2 while [#1 GT 0]\n#1=[#1-1]\n"
        "o3 if [#1 EQ 1]\no1 call [#1] [9]\no3 elseif [#<a> LT 3]\nG4 P.1\no3 else\nG0 Y#1\no3 endif\no2 endwhile\n"
        "o4 repeat [2]\nM98 P9 L2\no4 endrepeat\nM2\nO9\nG0 Z1\nM99\n",
        "F100 S1 M3 G98\nM70\nG10 L1 P1 X1 Z5 R2\nG10 L10 P2 Z1\nG43 H1 G80 G0 X#5401\nG33.1 Z-1 K2\nG18 G84 X1 Z1 Y-1 R1\n"
        "o1 sub\nM73 G20 G91\no2 if [EXISTS[#9]]\no2 return [1]\no2 endif\no1 endsub\no1 call (c) [1] [2]\nM72\nM19 R9 P1\n"
        "M67 E1 Q2\nG64 P1 R2\nM71 (abort, x)\nN1.5 M2\n",
        "M428\nG93 G1 X1 Y2 Z3 A10 C-20 F3\nG94 F100 A20\nG43.4 H1\nTRAORI\nB5\nM129\nM2\n",
    ],
    "mts": [
        "N05 G21 G90\nN10 M06 T01\nN15 S1200 F100 M03\nN20 G92 X-100 Y+100 Z+100\nN25 G81 Z-15 W2\n"
        "N30 G78 X100 Y-75 D+100 S3\nN35 G79\nG82 Z-47 W+5 B+0.5 D+5 K+20\n"
        "G77 X1 Y2 R3 A4 D90 S4\nG79\nG80\nG83 Z-9 K3\nG79 X5\nM30\n"
    ],
    "fanuc": [
        "%\nO1234(PART)\nG21G90G17G40G80\nT1M6\nG54G0X0Y0S900M3\nG43H1Z5.M8\nG05.1Q1\nG1Z-1.F100.\n"
        "G41D1X10.\nY20.,R2.\nX40.,C1.\n"
        "G40Y0\nG98G83X1.Y1.Z-9.R2.Q3.\nX5.K2\nG80\nG91G28Z0\nM30\n%\n",
        "O2\nG21 F100 S1 M3\n#1=3 #100=[#1*2+SIN[30]]\nWHILE[#1GT0]DO1\nG1 X#1 Y[#100/2]\n#1=#1-1\nEND1\n"
        "IF[#5041 GE 2]GOTO 9\nG65 P3 A1. I2. J3. I4.\n"
        "N9 G66 P3 B2.\nX1.\nG67\n#5221=4.\nG54 G0 X#13001\nM98 P30003\nM30\nO3\nG1 Z-#2\nM99\n",
        "O4\nG21 F100 S1 M3\nG68.2 P2 Q1 X1.\nG68.2 P2 Q2 X2.\nG68.2 P2 Q3 Y1. Z1.\nG53.1\nG1 X5. Y5.\n"
        "G2 X9. I2.\nG69\nG68 X0 Y0 I1. R30.\nG0 X1.\nG69\n"
        "G16 G81 X9. Y30. Z-1. R1.\nY60.\nG15 G80\nG51 X0 Y0 P2.\nG51.1 X0\nG3 X5. R9.\nG50.1\nG50\n"
        "G43.5 H1\nG1 X1. I0 J0 K1.\nG49\nG10 L2 P1 X1.\n"
        "G54.1 P3\nG12.1\nG7.1 C0\nG28 X0 M5\n",
    ],
    "haas": [
        "O1\nG20 F9. S1 M3\nT1 M6\nG154 P2\nG187 P1\nG81 Z-.1 R.1 L0\nG70 I1. J10. L6\nG71 I1. J0 K30. L3\n"
        "G72 I.2 J45. L4\nG80\nG13 D1 I.3 K1. Q.2 Z-.1 F9.\n"
        "G91 G12 D0 I.4 Z-.1 L3\nG90 G83 X0 Z-1. R.1 I.3 J.1 K.1\nG80 G101 X0\nG0 X1.\nG100\nM97 P100\nM30\nN100 G0 Y1.\nM99\n",
    ],
    "okuma": [
        "$A.MIN%\nO1\nG15 H1\nG21 G90 F100 S1 M3\nT1 M6\nG56 HA Z20\nG71 Z30\nG81 X1 Y1 Z-1 R2 M53\nX2\nG80\n"
        "VC1=2\nIF [VC1 EQ 2] N10\nG0 X=VC1\n"
        "N10 G11 X1 P30\nG1 X5 Y5\nG10\nCALL O5\nM2\nO5\nG0 Z1\nRTS\n",
    ],
    "sinumerik": [
        '%_N_A_MPF\nN10 G71 G90 G17 G54\nT="MILL" D1\nM6\nS1000 M3 F200\n'
        "R1=5 R2=R1*2\nG0 X=R1 Y0 Z5\nG1 Z=IC(-1)\nG2 X10 Y0 CR=8\nG3 X0 AR=90 I5\n"
        "TRANS X10\nAROT RPL=30\nG1 X5 RND=1\nY9 CHF=2\nX0\nROT\nIF R1>2 GOTOF A1\nG0 X1\nA1: WHILE R1>0\nR1=R1-1\nENDWHILE\n"
        "MCALL CYCLE81(5,0,1,-9)\nX1 Y1\nMCALL\nTRAORI\nG1 X1 A3=0 B3=0 C3=1\nTRAFOOF\nCYCLE800()\nM30\n",
    ],
    "heidenhain": [
        "0 BEGIN PGM A MM\n1 BLK FORM 0.1 Z X+0 Y+0 Z-20\n2 BLK FORM 0.2 X+100 Y+100 Z+0\n"
        "3 TOOL CALL 1 Z S2000 DL+0.1\n4 L X+0 Y+0 Z+50 R0 FMAX M3\n"
        "5 Q1=+5 Q2 = Q1 * SIN 30\n6 L Z-Q1 F200\n7 CC X+10 Y+0\n8 C X+20 Y+0 DR-\n9 CR X+30 Y+5 R+9 DR+\n"
        "10 RND R2\n11 L IX+9\n12 CHF 1\n13 L IY+9\n"
        "14 CYCL DEF 7.0\n15 CYCL DEF 7.1 X+5\n"
        "16 CYCL DEF 200 DRILLING Q200=2 Q201=-9 Q206=99 Q202=3 Q210=0 Q203=+0 Q204=9 Q211=0\n17 L X+1 FMAX M99\n"
        "18 LBL 1\n19 L IX+1\n20 CALL LBL 1 REP 2\n21 FN 9: IF +Q1 EQU +5 GOTO LBL 2\n22 LBL 2\n"
        "23 PLANE SPATIAL SPA+30 SPB+0 SPC+0 STAY\n24 M128\n25 END PGM A MM\n",
    ],
    "heidenhain-iso": [
        "%A G71 *\nN10 G30 G17 X+0 Y+0 Z-20*\nN20 G31 G90 X+90 Y+90 Z+0*\nN30 T1 G17 S900*\n"
        "N40 G00 G40 G90 Z+50 M3*\nN50 X+10 Y+5*\nN60 G01 G41 Z-2 F100*\n"
        "N70 G26 R2*\nN80 I+20 J+0*\nN90 G02 X+30 Y+5*\nN95 G25 R1*\nN96 G01 X+9*\nN97 G54 X+5*\n"
        "N98 G98 L1*\nN99 L1,2*\nN999999 %A G71 *\n",
    ],
    "apt": [
        "PARTNO X\nUNITS/MM\nMULTAX/ON\nLOADTL/1\nCUTTER/10,1\nSPINDL/RPM,500,CLW\nRAPID\nGOTO/0,0,50,0,0,1\nFEDRAT/200,MMPM\n"
        "GOTO/1,2,$\n3,0,.6,.8\nCIRCLE/0,2,3,0,0,1,1\nGOTO/-1,2,3\n$$ c\nGODLTA/1,1,1\nDELAY/2\nFINI\n"
    ],
    "poses": [
        "x_mm,y_mm,z_mm,i,j,k,feed_mm_min,rapid,tool\n0,0,9,0,0,1,,1,1\n1,2,3,0,.6,.8,200,,\n4,5,6,0,0,1,,0,2\n",
        "x_mm,y_mm,z_mm,a_deg,c_deg,feed_mm_min\n0,0,9,0,0,100\n1,2,3,-20,30,\n",
    ],
}
LETTERS: Final = "GXYZFNMSTIJKRPQLDHABCUVWO@^#%/()[];:.+-*0123456789 \t\n\r<>=,$'\"\0é"
_TOKENS: Final = (
    "G0 G1 G2 G3 G41 G42.1 G40 G81 G83 G90 G91 G20 G21 G92 G28 G53 G10 G93 G95 G54 G18 M98 M99 M2 M30 M6 T1 L2 P1 "
    "M70 M72 M73 M19 R1 M62 G33.1 K1 (abort,) G10 L11 "
    "G65 P3 G66 G67 M198 G68.2 G68 G69 G16 G51 G53.1 GOTO WHILE DO1 END1 IF[ THEN VC1=1 "
    "CYCLE81( TRANS ROT GOTOF LBL CALL Q1=2 FMAX ,R1. ,C1 "
    "o1 sub endsub call if endif while endwhile repeat [1] [#1+1] #1=2 #<x> SQRT[2] X1e5 X999999999 R0 D0 Q0 % "
    "GOTO/ FEDRAT/ MULTAX RAPID 1,2,3 nan inf , 0 -1"
)


def _plain(lines: int) -> bytes:
    body = "".join(
        f"G1 X{k % 100}.5 Y{k % 77}.25 Z-{k % 9}.125 F{100 + k % 50}\n" for k in range(min(lines, 10_000))
    )
    return ("G21 G90 S1 M3\n" + body * (lines // min(lines, 10_000)) + "M2\n").encode()


def nc() -> Iterator[dict[str, Any]]:
    """Lines a second of processor time by kind of block; memory of a million lines."""
    head = "G21 G90 S1 M3 F100\nG0 X0 Y0 Z5\n"
    count = 40_000
    bodies = {
        "rising": "".join(f"N{k + 1} G1 X{k % 100}.5 Y{k % 77}.25\n" for k in range(count)),
        "wrapping": "".join(f"N{k % 9999 + 1} G1 X{k % 100}.5 Y{k % 77}.25\n" for k in range(count)),
        "arcs": "G2 X10 Y0 I5 J0 (c)\nG3 X0 Y0 I-5 J0\n" * (count // 2),
        "five axes": "G93\nG1 X0 Y0 Z5 A0 C0 F9\n"
        + "".join(
            f"X{k % 100}.5 Y{k % 77}.25 Z-.125 A{k % 50}.5 C{k % 90}.25 F{100 + k % 50}.5\n"
            for k in range(count)
        ),
        "expressions": "#1=2 #2=3\n"
        + "".join(f"G1 X[#1+{k % 100}.5] Y[#2*{k % 77}.25-1] Z-.5\n" for k in range(count)),
        "assignments": "#1=2 #2=3\n"
        + "".join(f"#1=[#2*{k % 77}.25]\nG1 X#1 Y[SIN[#1]]\n" for k in range(count // 2)),
        "cycles": "G98 G81 X1 Y1 Z-1 R1\nX2\nG80\n" * 3000,
        "compensation": "G41.1 D1 G1 X20 Y0\n"
        + "G1 X20 Y20\nG1 X40 Y20\nG1 X40 Y0\n" * 3000
        + "G40 G1 X60 Y-9\n",
        "loop": "#1=0\no1 while [#1 LT 20000]\n#1=[#1+1]\nG1 X#1\no1 endwhile\n",
    }
    for name, data, lines in (
        ("plain", _plain(200_000), 200_000),
        *(
            (name, (head + body + "M2\n").encode(), 80_000 if name == "loop" else body.count("\n"))
            for name, body in bodies.items()
        ),
    ):
        begin = process_time()
        program = parse_program(data, name, tools=TOOLS, rotary="AC")
        seconds = process_time() - begin
        program.require_clean()
        yield {
            "case": "nc", "program": name, "lines": lines, "moves": len(program.moves), "seconds": seconds,
            "lines_per_s": lines / seconds,
        }  # fmt: skip
        if name == "plain":
            begin = process_time()
            text = sum(len(json.dumps(move_record(move))) for move in program.moves)
            seconds = process_time() - begin
            yield {"case": "nc", "program": "moves as JSON", "bytes": text, "lines_per_s": lines / seconds}
    begin = process_time()
    program = parse_program(_plain(1_000_000), "million")
    yield {
        "case": "nc", "program": "million", "lines": 1_000_000, "moves": len(program.moves),
        "seconds": process_time() - begin, "peak_mb": getrusage(RUSAGE_SELF).ru_maxrss / 1024,
    }  # fmt: skip


def mutant(rng: random.Random) -> tuple[str, bytes]:
    """Dialect, and a program damaged in a few places."""
    dialect = rng.choice(("iso", "iso", "iso", "fanuc", "fanuc", "fanuc", *SEEDS))
    if rng.random() < 0.05:
        return dialect, rng.randbytes(rng.randrange(80))
    text = rng.choice(SEEDS[dialect])
    for _ in range(rng.randrange(1, 6)):
        at, kind = rng.randrange(len(text) + 1), rng.random()
        if kind < 0.35:
            text = text[:at] + rng.choice(LETTERS) + text[at + 1 :]
        elif kind < 0.55:
            text = text[:at] + rng.choice(LETTERS) + text[at:]
        elif kind < 0.7:
            text = text[:at] + text[at + rng.randrange(1, 8) :]
        elif kind < 0.85:
            text = text[:at] + rng.choice(("", " ", "\n")) + rng.choice(_TOKENS.split(" ")) + text[at:]
        else:
            lines = text.split("\n")
            one, two = rng.randrange(len(lines)), rng.randrange(len(lines))
            lines[one], lines[two] = lines[two], rng.choice((lines[one], lines[two]))
            text = "\n".join(lines)
    return dialect, text.encode()


def verdict(dialect: str, data: bytes) -> str:
    """ "clean", "findings", "refused", or what is wrong with the answer."""
    begin = process_time()
    try:
        program = parse_program(data, "fuzz", dialect=dialect, tools=TOOLS, rotary="AC", max_steps=300)
    except NCError:
        return "refused"
    except Exception as exc:
        return f"undeclared {type(exc).__name__}: {exc}"
    if process_time() - begin > SLOWEST_S:
        return "hang"
    return _fault(program) or ("findings" if program.errors else "clean")


def _fault(program: Program) -> str | None:
    lines = program.data.count(b"\n") + program.data.count(b"\r") + 1
    for finding in program.findings:
        if finding.code not in CATALOGUE or not 1 <= finding.line <= lines or finding.col < 1:
            return f"finding without a place: {finding}"
    for move in program.moves:
        if not all(map(math.isfinite, (*move.start, *move.end, *move.end_machine, *move.end_program))):
            return f"motion to nowhere: {move}"
    return None


def skipped(rng: random.Random) -> str | None:
    """A word that no code takes, put into a good program, must be found; None when it is."""
    dialect = rng.choice(("iso", "iso", "mts"))
    lines = rng.choice(SEEDS[dialect][:4]).split("\n")
    places = [k for k, line in enumerate(lines) if line and line[0] not in "%O"]
    k = rng.choice(places)
    code = rng.choice(("V1", "U2", "E3", "G123", "M77", "K4 K4"))
    lines[k] += " " + code
    program = parse_program("\n".join(lines).encode(), "word", dialect=dialect, tools=TOOLS)
    if any(finding.line == k + 1 and finding.severity == "E" for finding in program.findings):
        return None
    return f"{code} in line {k + 1} was skipped: {lines}"


def nc_fuzz() -> Iterator[dict[str, Any]]:
    """Damaged programs; VMACHINING_FUZZ_INPUTS says how many (default 20000), VMACHINING_FUZZ_FIRST which is first."""
    count, begin = int(os.environ.get(FUZZ_VARIABLE, "20000")), perf_counter()
    first = int(os.environ.get(FIRST_VARIABLE, "0"))
    verdicts: Counter[str] = Counter()
    faults: list[str] = []
    for k in range(first, first + count):
        rng = random.Random(k)
        dialect, data = mutant(rng)
        found = verdict(dialect, data)
        verdicts[found if found in ("clean", "findings", "refused") else "faults"] += 1
        if found not in verdicts:
            faults.append(f"{k}: {found}: {data!r}")
        if k % 20 == 0 and (silent := skipped(rng)) is not None:
            faults.append(f"{k}: {silent}")
    yield {
        "case": "nc_fuzz", "first": first, "inputs": count, **{name: verdicts[name] for name in ("clean", "findings", "refused")},
        "faults": len(faults), "first_faults": faults[:5], "seconds": perf_counter() - begin,
    }  # fmt: skip
