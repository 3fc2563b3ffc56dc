"""Writes the programs and jobs of the reference set, one folder each; `vmachining pack models/reference_pack` runs them.

Each program is short (20 to 120 blocks) and shows one thing that simulations of milling get wrong. Coordinates are written to
1e-4 mm, feeds are of no importance. `slot` is the model of that name.
"""

from __future__ import annotations

from collections.abc import Callable
from math import cos, pi, radians, sin, sqrt, tan
from pathlib import Path

from benchmarks import modelfiles

HERE = Path(__file__).parent
HOME = (0.0, 0.0, 60.0)

Files = dict[str, str]


def number(value: float, decimals: int = 4) -> str:
    """Four decimals, and unit vectors more."""
    return modelfiles.number(value, decimals)


class Nc:
    """Lines of a program of dialect iso; the first comment says what it shows."""

    def __init__(self, *comments: str) -> None:
        self.lines = [f"({text})" for text in comments] + ["G21 G90 G17 G94 G40 G49 G80 G54"]

    def tool(self, number_: int, speed: int = 8000) -> None:
        """Change the tool, far above."""
        self.lines += [f"T{number_} M6", f"S{speed} M3", "G0 Z20"]

    def go(self, code: str, **words: float) -> None:
        """One block: go("G1", x=3, f=500)."""
        self.lines.append(" ".join([code, *(k.upper() + number(v) for k, v in words.items())]))

    def down(self, x: float, y: float, z: float, feed: float = 200.0) -> None:
        """Rapid to a place, rapid to 1 mm above the stock, plunge to z."""
        self.go("G0", x=x, y=y)
        self.go("G0", z=1.0)
        self.go("G1", z=z, f=feed)

    def up(self) -> None:
        """Out."""
        self.go("G0", z=20.0)

    @property
    def text(self) -> str:
        """The program."""
        return "\n".join([*self.lines, "G0 Z20", "M5", "M30"]) + "\n"


def job(
    name: str,
    program: str,
    stock: str,
    tools: list[str],
    *,
    chord: float = 0.01,
    width: float | None = None,
    dialect: str = "iso",
    chain: str = "xyz",
) -> str:
    """A job file; tools as lines of TOML."""
    listed = "".join(f"\n[[tools]]\nnumber = {k}\n{tool}\n" for k, tool in enumerate(tools, start=1))
    return (
        f"""name = "{name}"
units = "mm"

[program]
file = "{program}"
dialect = "{dialect}"
home = [{", ".join(number(v) for v in HOME)}]

[machine]
chain = "{chain}"
{listed}
[stock]
{stock}

[accuracy]
chord_mm = {chord:g}
{"" if width is None else f"width = {width:g}"}
""".rstrip()
        + "\n"
    )


def box(low: tuple[float, float, float], high: tuple[float, float, float]) -> str:
    """[stock] as a block."""
    return "box = {{ min = [{}], max = [{}] }}".format(
        *(", ".join(number(v) for v in p) for p in (low, high))
    )


def round_tool(kind: str, diameter: float, corner: float | None = None, length: float = 40.0) -> str:
    """flat, ball, or bull with a corner radius."""
    corner_ = "" if corner is None else f"\ncorner_radius_mm = {corner:g}"
    return f'type = "{kind}"\ndiameter_mm = {diameter:g}{corner_}\nlength_mm = {length:g}\nflutes = 2'


def meridian(*points: tuple[float, float]) -> str:
    """A cutter by its meridian (r, z)."""
    return f'type = "profile"\nprofile = [{", ".join(f"[{number(r)}, {number(z)}]" for r, z in points)}]\nflutes = 2'


def iso(name: str, nc: Nc, stock: str, tools: list[str], **more: float | str) -> Files:
    """Program and job of a case."""
    return {f"{name}.nc": nc.text, "job.toml": job(name, f"{name}.nc", stock, tools, **more)}  # type: ignore[arg-type]


def shipped(name: str) -> Files:
    """Program and job of a model, without what a pack is not about."""
    folder = HERE.parent / name
    lines = (folder / "job.toml").read_text(encoding="utf-8").split("[feed]")[0].rstrip().splitlines()
    text = "\n".join([line for line in lines if not line.startswith("width = ")] + ["width = 0.002", ""])
    return {f"{name}.nc": (folder / f"{name}.nc").read_text(encoding="ascii"), "job.toml": text}


def wave(x: float, y: float) -> float:
    """A gentle surface."""
    return -2.0 + 0.8 * sin(x / 5.0) * cos(y / 6.0)


def thin_chips() -> Files:
    """Ball passes over a wave, then the same a step aside and 0.05 mm deeper: chips of some hundredths of a millimetre."""
    nc = Nc("BALL D8, CHIPS OF SOME HUNDREDTHS OF A MILLIMETRE", "STOCK X 0..30 Y 0..20 Z -10..0")
    nc.tool(1, 12000)
    for deeper, shift in ((0.0, 0.0), (0.05, 0.25)):
        for row in range(8):
            y = 2.0 + shift + 2.2 * row
            xs = [-5.0 + 40.0 * k / 6 for k in range(7)]
            xs = xs if row % 2 == 0 else xs[::-1]
            if row == 0:
                nc.down(xs[0], y, wave(xs[0], y) - deeper)
            for x in xs:
                nc.go("G1", x=x, y=y, z=wave(x, y) - deeper, f=1500)
        nc.up()
    return iso("thin_chips", nc, box((0, 0, -10), (30, 20, 0)), [round_tool("ball", 8)], width=0.002)


def re_entry() -> Files:
    """Bull nose across five slots, up and down: each block leaves the material and comes back several times."""
    nc = Nc("FIVE SLOTS BY FLAT D6, THEN BULL D10 R2 ACROSS THEM: BLOCKS THAT LEAVE AND RE-ENTER")
    nc.tool(1)
    for k in range(5):
        nc.down(6.0 + 11.0 * k, -5.0, -5.0)
        nc.go("G1", y=35.0, f=600)
        nc.up()
    nc.tool(2)
    for row in range(6):
        y = 2.0 + 5.2 * row
        nc.down(-8.0, y, -2.0 - 0.3 * row)
        for k in range(1, 7):
            nc.go("G1", x=-8.0 + 12.0 * k, z=-2.0 - 0.3 * row - (0.6 if k % 2 else 0.0), f=900)
        nc.up()
    return iso(
        "re_entry",
        nc,
        box((0, 0, -12), (56, 30, 0)),
        [round_tool("flat", 6), round_tool("bull", 10, 2)],
        width=0.002,
    )


def plunges() -> Files:
    """Plunge roughing: each plunge takes what its neighbours left, down to slivers and to nothing."""
    nc = Nc("PLUNGE ROUGHING, FLAT D10, HOLES 6 MM APART, AND ONCE MORE BETWEEN THEM")
    nc.tool(1)
    places = [(6.0 * i + 3.0 * (j % 2), 5.2 * j) for j in range(4) for i in range(5)]
    places += [(6.0 * i + 3.0, 5.2 * j + 2.6) for j in range(2) for i in range(3)]
    for k, (x, y) in enumerate(places):
        nc.go("G0", x=x, y=y)
        nc.go("G0", z=0.5)
        nc.go("G1", z=-8.0 - 0.25 * (k % 3), f=150)
        nc.go("G0", z=2.0)
    return iso("plunges", nc, box((-8, -8, -20), (36, 26, 0)), [round_tool("flat", 10)], width=0.002)


def drilling() -> Files:
    """Canned cycles with a pointed drill through the floor and the wall of a milled step."""
    nc = Nc("DRILL D6 WITH A POINT OF 118 DEGREES, CYCLES G81 G82 G83 G73, OVER A MILLED STEP")
    nc.tool(1)
    nc.down(-8.0, 10.0, -4.0)
    nc.go("G1", x=48.0, f=600)
    nc.up()
    nc.tool(2, 3000)
    for k, (cycle, more) in enumerate(
        (("G81", {}), ("G82", {"p": 0.2}), ("G83", {"q": 3.0}), ("G73", {"q": 4.0}))
    ):
        for j, y in enumerate((4.0, 13.5, 20.0)):
            nc.go(
                f"G98 {cycle}" if j == 0 else "",
                x=7.0 + 8.5 * k,
                y=y,
                **({"z": -11.0 - j, "r": 1.0, **more, "f": 120.0} if j == 0 else {}),
            )
        nc.lines.append("G80")
    nc.lines = [line.strip() for line in nc.lines]
    drill = meridian((0, 0), (3, 3 / tan(radians(59))), (3, 45))
    return iso("drilling", nc, box((0, 0, -20), (40, 25, 0)), [round_tool("flat", 12), drill], width=0.002)


def chamfer() -> Files:
    """A boss with round corners, outlined by a flat end mill, its edge broken by a tapered cutter that follows arcs."""
    nc = Nc("BOSS WITH ROUND CORNERS, FLAT D10, THEN A CHAMFER BY A 45 DEGREE CUTTER WITH TIP D2")

    def around(offset: float, z: float, feed: float) -> None:
        a, b, r = 14.0 + offset, 9.0 + offset, 4.0 + offset
        nc.go("G0", x=-a - 8.0, y=-(b - r))
        nc.go("G0", z=1.0)
        nc.go("G1", z=z, f=300)
        nc.go("G1", x=-a, y=-(b - r), f=feed)
        nc.go("G1", y=b - r)
        nc.go("G2", x=-(a - r), y=b, i=r, j=0.0)
        nc.go("G1", x=a - r)
        nc.go("G2", x=a, y=b - r, i=0.0, j=-r)
        nc.go("G1", y=-(b - r))
        nc.go("G2", x=a - r, y=-b, i=-r, j=0.0)
        nc.go("G1", x=-(a - r))
        nc.go("G2", x=-a, y=-(b - r), i=0.0, j=r)
        nc.go("G1", x=-a - 8.0)
        nc.up()

    nc.tool(1)
    around(5.0, -3.0, 700)
    around(5.0, -6.0, 700)
    nc.tool(2)
    around(2.0, -1.8, 900)
    around(2.0, -2.0, 900)
    taper = (
        'type = "taper"\ndiameter_mm = 2\ntaper_deg = 45\nflute_length_mm = 6\nlength_mm = 30\n'
        "shank_diameter_mm = 6\nflutes = 2"
    )
    return iso("chamfer", nc, box((-22, -17, -12), (22, 17, 0)), [round_tool("flat", 10), taper])


def tslot() -> Files:
    """A T slot: the disc of the cutter works below material that stays."""
    nc = Nc("T SLOT: SLOT BY FLAT D8, THEN A T CUTTER D16 WITH NECK D6 BELOW THE LEDGES")
    nc.tool(1)
    nc.down(-6.0, 15.0, -5.0)
    nc.go("G1", x=56.0, f=500)
    nc.go("G1", z=-10.0, f=200)
    nc.go("G1", x=-6.0, f=500)
    nc.up()
    nc.tool(2, 3000)
    nc.go("G0", x=-12.0, y=15.0)
    nc.go("G0", z=-10.0)
    for k in range(1, 15):
        nc.go("G1", x=-12.0 + 5.0 * k, y=15.0 + (0.4 if k % 3 == 0 else 0.0), f=250)
    nc.go("G1", x=64.0, y=15.0)
    nc.go("G0", x=70.0)
    nc.up()
    cutter_ = meridian((0, 0), (8, 0), (8, 4), (3, 4), (3, 40))
    return iso("tslot", nc, box((0, 0, -18), (50, 30, 0)), [round_tool("flat", 8), cutter_])


def lollipop() -> Files:
    """A ball on a thin neck under the wall of a pocket: lines, ramps and arcs."""
    nc = Nc("POCKET BY FLAT D12, THEN A LOLLIPOP D8 UNDER ITS WALLS: LINES, RAMPS, ARCS")
    nc.tool(1)
    nc.down(12.0, 15.0, -9.0)
    nc.go("G1", x=28.0, f=400)
    nc.up()
    nc.tool(2, 9000)
    nc.go("G0", x=20.0, y=15.0)
    nc.go("G0", z=-8.0)
    nc.go("G1", y=18.0, f=400)
    for z in (-7.0, -6.2):
        nc.go("G1", x=13.0, y=18.2, z=z)
        nc.go("G3", x=13.0, y=11.8, i=0.0, j=-3.2)
        nc.go("G1", x=20.0, y=11.6, z=z + 0.5)
        nc.go("G1", x=27.0, y=11.8, z=z)
        nc.go("G3", x=27.0, y=18.2, i=0.0, j=3.2)
        nc.go("G1", x=20.0, y=18.4)
    nc.go("G1", y=15.0)
    nc.up()
    ball = 4.0
    points = [(0.0, 0.0)]
    high = ball + sqrt(ball**2 - 1.5**2)
    points += [(ball * sin(t), ball - ball * cos(t)) for t in (pi * k / 24 for k in range(1, 21))]
    points = [p for p in points if p[1] < high and (p[1] < ball or p[0] > 1.6)]
    return iso(
        "lollipop",
        nc,
        box((0, 0, -16), (40, 30, 0)),
        [round_tool("flat", 12), meridian(*points, (1.5, high), (1.5, 40))],
    )


def arcs() -> Files:
    """Ball on arcs in all three planes, both ways, quarters to full turns."""
    nc = Nc("BALL D10 ON ARCS IN G17, G18 AND G19, BOTH WAYS, QUARTERS, HALVES AND FULL TURNS")
    nc.tool(1)
    nc.down(10.0, 15.0, -2.0)
    nc.go("G17 G3", x=10.0, y=15.0, i=6.0, j=0.0, f=500)
    nc.go("G2", x=16.0, y=21.0, i=6.0, j=0.0)
    nc.go("G3", x=22.0, y=15.0, i=0.0, j=-6.0)
    nc.up()
    for y, way in ((8.0, "G3"), (20.0, "G2")):
        x0, x1 = (34.0, 54.0) if way == "G3" else (54.0, 34.0)
        nc.go("G0", x=x0, y=y)
        nc.go("G0", z=3.0)
        nc.go("G1", z=0.5, f=300)
        nc.go(
            "G18 " + ("G2" if way == "G2" else "G3"), x=x1, z=0.5, i=(x1 - x0) / 2, k=8.0, f=500
        )  # through below
        nc.up()
        nc.lines.append("G17")
    for x, way in ((64.0, "G2"), (74.0, "G3")):
        y0, y1 = (4.0, 26.0) if way == "G3" else (26.0, 4.0)
        nc.go("G0", x=x, y=y0)
        nc.go("G0", z=3.0)
        nc.go("G1", z=0.0, f=300)
        nc.go("G19 " + way, y=y1, z=0.0, j=(y1 - y0) / 2, k=12.0, f=500)
        nc.go("G17 G1", z=-1.0, f=200)
        nc.up()
    nc.go("G0", x=84.0, y=15.0)
    nc.go("G0", z=1.0)
    nc.go("G1", z=-2.5, f=200)
    nc.go("G18 G2", x=92.0, z=-2.5, i=4.0, k=9.0)
    nc.go("G19 G3", y=23.0, z=-2.5, j=4.0, k=9.0)
    nc.go("G17 G2", x=96.0, y=19.0, i=0.0, j=-4.0)
    return iso("arcs", nc, box((0, 0, -15), (104, 30, 0)), [round_tool("ball", 10)], chord=0.01)


def helices() -> Files:
    """Bull nose on helices: into the material by G17 in several turns, along y and along x by G18 and G19."""
    nc = Nc("BULL D8 R2 ON HELICES: G17 WITH SEVERAL TURNS, G18 ALONG Y, G19 ALONG X")
    nc.tool(1)
    nc.go("G0", x=12.0, y=15.0)
    nc.go("G0", z=0.5)
    for k in range(1, 5):
        nc.go("G3", x=12.0, y=15.0, z=0.5 - 1.25 * k, i=3.0, j=0.0, f=300)
    nc.go("G3", x=12.0, y=15.0, i=3.0, j=0.0)
    nc.go("G3", x=18.0, y=15.0, z=-3.0, i=3.0, j=0.0)
    nc.up()
    nc.go("G0", x=30.0, y=4.0)
    nc.go("G0", z=1.0)
    nc.go("G1", z=0.0, f=200)
    nc.go("G18 G3", x=46.0, y=16.0, z=0.0, i=8.0, k=9.0, f=300)
    nc.go("G18 G2", x=30.0, y=26.0, z=0.0, i=-8.0, k=9.0)
    nc.lines.append("G17")
    nc.up()
    nc.go("G0", x=54.0, y=4.0)
    nc.go("G0", z=1.0)
    nc.go("G1", z=0.0, f=200)
    nc.go("G19 G3", x=60.0, y=26.0, z=0.0, j=11.0, k=16.0, f=300)
    nc.go("G19 G2", x=66.0, y=4.0, z=0.0, j=-11.0, k=16.0)
    nc.lines.append("G17")
    return iso("helices", nc, box((0, 0, -14), (72, 30, 0)), [round_tool("bull", 8, 2)], chord=0.01)


def trochoid() -> Files:
    """Trochoidal slot: full circles that advance by 0.7 mm, each in material for a third of its way."""
    nc = Nc("TROCHOIDAL SLOT, FLAT D6, CIRCLES OF 2.5 MM THAT ADVANCE BY 0.7 MM")
    nc.tool(1)
    nc.down(-6.0, 10.0, -4.0)
    x = -6.0
    for _ in range(32):
        nc.go("G2", x=x, y=10.0, i=0.0, j=-2.5, f=1200)
        x += 0.7
        nc.go("G1", x=x)
    return iso("trochoid", nc, box((0, 0, -10), (26, 16, 0)), [round_tool("flat", 6)])


def thread() -> Files:
    """A thread milled in a bore: a form cutter on a helix, below material that stays."""
    nc = Nc("BORE BY FLAT D8 ON A HELIX, THEN A THREAD OF PITCH 2 BY A FORM CUTTER D9")
    nc.tool(1)
    nc.go("G0", x=18.0, y=15.0)
    nc.go("G0", z=0.0)
    for k in range(1, 7):
        nc.go("G3", x=18.0, y=15.0, z=-2.0 * k, i=-3.0, j=0.0, f=400)
    nc.go("G3", x=18.0, y=15.0, i=-3.0, j=0.0)
    nc.go("G1", x=15.0)
    nc.up()
    nc.tool(2, 6000)
    nc.go("G0", x=15.0, y=15.0)
    nc.go("G0", z=-9.0)
    nc.go("G1", x=18.4, f=200)
    for k in range(1, 3):
        for quarter in range(4):
            angle = 0.5 * pi * (quarter + 1)
            nc.go(
                "G3",
                x=15.0 + 3.4 * cos(angle),
                y=15.0 + 3.4 * sin(angle),
                z=-9.0 + 2.0 * (k - 1) + 0.5 * (quarter + 1),
                i=-3.4 * cos(angle - 0.5 * pi),
                j=-3.4 * sin(angle - 0.5 * pi),
                f=300,
            )
    nc.go("G1", x=15.0, y=15.0)
    nc.up()
    cutter_ = meridian((0, 0), (3.4, 0), (4.5, 0.7), (3.4, 1.4), (2.2, 1.5), (2.2, 40))
    return iso("thread", nc, box((0, 0, -16), (30, 30, 0)), [round_tool("flat", 8), cutter_], chord=0.02)


def apt_cutter() -> Files:
    """A cutter of all seven APT parameters along straight, sloping and falling lines."""
    nc = Nc(
        "APT CUTTER D 12, R 3, E 4, F 3.5, ALPHA 8, BETA 6, H 30: LEVEL, SLOPING, RISING AND FALLING BLOCKS"
    )
    nc.tool(1)
    for row in range(5):
        y = 4.0 + 4.5 * row
        xs = [-10.0 + 60.0 * k / 7 for k in range(8)]
        xs = xs if row % 2 == 0 else xs[::-1]
        if row == 0:
            nc.down(xs[0], y, -4.0)
        for k, x in enumerate(xs):
            nc.go("G1", x=x, y=y + 0.4 * (k % 2), z=-4.0 + 1.6 * sin(0.9 * k + row), f=700)
    tool = 'type = "apt"\napt = { d = 12, r = 3, e = 4, f = 3.5, alpha_deg = 8, beta_deg = 6, h = 30 }\nflutes = 2'
    return iso("apt_cutter", nc, box((0, 0, -14), (40, 26, 0)), [tool], width=0.002)


def steep() -> Files:
    """Taper with a ball tip on ramps from level to upright."""
    nc = Nc("TAPER WITH A BALL TIP R2, HALF ANGLE 5: RAMPS FROM LEVEL TO UPRIGHT, DOWN AND UP")
    nc.tool(1)
    for k in range(9):
        y, slope = 3.0 + 3.4 * k, radians(10.0 * k)
        nc.down(4.0, y, -0.5)
        nc.go("G1", x=4.0 + 9.0 * cos(slope), z=-0.5 - 9.0 * sin(slope), f=200)
        nc.go("G1", x=4.0 + 9.0 * cos(slope) + 5.0, z=-1.0)
        nc.up()
    tool = (
        'type = "taper"\ndiameter_mm = 4\ncorner_radius_mm = 2\ntaper_deg = 5\nflute_length_mm = 18\n'
        "length_mm = 40\nshank_diameter_mm = 7\nflutes = 2"
    )
    return iso("steep", nc, box((0, 0, -15), (26, 33, 0)), [tool], width=0.002)


Pose = tuple[float, float, float, float, float, float]


def poses(name: str, rows: list[tuple[Pose, bool]], stock: str, tools: list[str], chord: float) -> Files:
    """Table of tool tips and axes, and its job; the second of a row says whether the motion to it is a rapid."""
    lines = ["x_mm,y_mm,z_mm,i,j,k,feed_mm_min,rapid,tool"]
    for (x, y, z, i, j, k), rapid in rows:
        size = sqrt(i * i + j * j + k * k)
        cells = [number(v) for v in (x, y, z)] + [number(v / size, 9) for v in (i, j, k)]
        lines.append(",".join([*cells, "800", "1" if rapid else "0", "1"]))
    text = "\n".join(lines) + "\n"
    return {
        f"{name}.csv": text,
        "job.toml": job(name, f"{name}.csv", stock, tools, chord=chord, dialect="poses", chain="xyz"),
    }


def passes(lines: list[list[Pose]], lift: float = 25.0) -> list[tuple[Pose, bool]]:
    """Rows of passes: each is reached by rapids along its axis from far off, and left so."""
    rows: list[tuple[Pose, bool]] = []
    for line in lines:
        ends = [
            (*(a + lift * b for a, b in zip(p[:3], p[3:], strict=True)), *p[3:]) for p in (line[0], line[-1])
        ]
        rows += [(ends[0], True), *((pose, False) for pose in line), (ends[1], True)]  # type: ignore[list-item]
    return rows


def five_lead() -> Files:
    """Bull nose that leans forward over a saddle, passes there and back."""
    lines = []
    for row in range(5):
        y = 3.0 + 3.5 * row
        line: list[Pose] = []
        for k in range(11):
            x = -3.0 + 3.0 * k
            gx, gy = 0.16 * sin(x / 6.0), 0.02 * (y - 10.0)
            z = -2.0 - 0.96 * (cos(x / 6.0) - 1.0) - 0.01 * (y - 10.0) ** 2
            sense = 1.0 if row % 2 == 0 else -1.0
            line.append((x, y, z, -gx + sense * 0.14, gy + 0.05, 1.0))
        lines.append(line if row % 2 == 0 else line[::-1])
    return poses(
        "five_lead", passes(lines), box((0, 0, -12), (24, 20, 0)), [round_tool("bull", 8, 1.5)], 0.005
    )


def five_swarf() -> Files:
    """Flank milling of a ruled wall by a taper with a ball tip: the axis follows the rulings."""
    lines = []
    for depth in (1.2, 0.0):
        line: list[Pose] = []
        for k in range(19):
            x = -6.0 + 2.5 * k
            lean = 0.12 + 0.22 * sin(x / 16.0)
            line.append((x, 6.0 + 2.0 * sin(x / 11.0) - depth, -12.0, 0.03, -lean, 1.0))
        lines.append(line if depth else line[::-1])
    tool = (
        'type = "taper"\ndiameter_mm = 6\ncorner_radius_mm = 3\ntaper_deg = 4\nflute_length_mm = 24\n'
        "length_mm = 45\nshank_diameter_mm = 9\nflutes = 2"
    )
    return poses("five_swarf", passes(lines, 40.0), box((0, 4, -18), (34, 24, 0)), [tool], 0.005)


def five_fixed() -> Files:
    """3+2: a flat end mill faces two slopes; the axis leans and does not turn."""
    lines = []
    for lean, side in ((20.0, 1.0), (35.0, -1.0)):
        i, k = side * sin(radians(lean)), cos(radians(lean))
        for row in range(4):
            y = 2.0 + 7.0 * row
            # down the slope, whose normal is the axis
            points = [
                (side * (4.0 + s * k), y, -1.2 - s * sin(radians(lean)), i, 0.0, k)
                for s in (-9.0, 1.0, 11.0, 17.0)
            ]
            lines.append(points if row % 2 == 0 else points[::-1])
    return poses("five_fixed", passes(lines), box((-18, 0, -16), (18, 26, 0)), [round_tool("flat", 8)], 0.005)


def five_pivot() -> Files:
    """Flat end mill that tilts on the spot and while it moves: what it leaves it comes back to within one block."""
    lines = []
    for row, lean in enumerate((0.35, 0.5, 0.25)):
        y = 5.0 + 8.0 * row
        line: list[Pose] = [(8.0, y, -3.0, 0.0, 0.0, 1.0)]
        line += [(8.0, y, -3.0, lean, 0.0, 1.0), (8.0, y, -3.0, 0.0, 0.6 * lean, 1.0)]
        line += [(16.0, y, -3.5, -lean, 0.1, 1.0), (16.0, y, -3.5, lean, 0.1, 1.0)]
        line += [(22.0, y + 1.0, -2.5, 0.0, -lean, 1.0), (24.0, y + 1.0, -3.0, 0.0, 0.0, 1.0)]
        lines.append(line)
    return poses("five_pivot", passes(lines), box((0, 0, -14), (32, 28, 0)), [round_tool("flat", 8)], 0.01)


def five_pocket() -> Files:
    """Ball in a narrow channel whose floor bends and twists, as between the blades of an impeller."""
    lines = []
    for row, depth in enumerate((2.5, 5.0)):
        for side in (-1.0, 1.0):
            line: list[Pose] = []
            for k in range(13):
                t = k / 12.0
                turn = 0.9 * t
                x, y = 4.0 + 26.0 * t, 10.0 + 6.0 * t * t + side * 1.5
                z = -depth - 2.0 * sin(pi * t)
                line.append((x, y, z, -0.25 * (1 - t), side * 0.12 + 0.3 * sin(turn) - 0.15, 1.0))
            lines.append(line if (side > 0) == (row % 2 == 0) else line[::-1])
    return poses(
        "five_pocket", passes(lines, 20.0), box((0, 0, -14), (34, 28, 0)), [round_tool("ball", 6)], 0.005
    )


def rotary() -> Files:
    """Rotary words on a table A C without tool centre point control: joints are linear, the tip follows a bow."""
    nc = Nc("TABLE A C, JOINT-LINEAR BLOCKS: A GROOVE THAT WRAPS AROUND A BLOCK, BALL D6")
    nc.tool(1)
    nc.go("G0", x=-20.0, y=0.0, a=0.0, c=0.0)
    nc.go("G0", z=14.0)
    nc.go("G1", z=8.0, f=300)
    for k in range(1, 13):
        nc.go("G1", x=-20.0 + 3.0 * k, z=8.0 + 0.3 * (k % 2), a=6.0 * k - 36.0, f=600)
    nc.go("G1", z=20.0)
    nc.go("G0", x=0.0, y=-14.0, a=-25.0, c=0.0)
    nc.go("G1", z=9.0, f=300)
    for k in range(1, 13):
        nc.go("G1", y=-14.0 + 0.5 * k, c=15.0 * k, f=600)
    return iso(
        "rotary", nc, box((-18, -9, -10), (18, 9, 10)), [round_tool("ball", 6)], chain="ac-table", chord=0.005
    )


CASES: dict[str, Callable[[], Files]] = {
    "slot": lambda: shipped("slot"),
    **{
        make.__name__: make
        for make in (
            thin_chips, re_entry, plunges, drilling, chamfer, tslot, lollipop, arcs, helices, trochoid, thread,
            apt_cutter, steep, five_lead, five_swarf, five_fixed, five_pivot, five_pocket, rotary,
        )
    },
}  # fmt: skip
"""By name; the engine of each, and what it shows, stand in set.toml."""


def main() -> None:
    """Write all of them."""
    for name, make in CASES.items():
        folder = HERE / name
        folder.mkdir(exist_ok=True)
        for file, text in make().items():
            (folder / file).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
