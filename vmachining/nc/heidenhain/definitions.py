"""What blocks without a motion say: blank, tools, cycles."""

from __future__ import annotations

import math
import re
from typing import Any, Final

from vmachining.nc.execution import MILLS
from vmachining.nc.heidenhain import cycles, milling
from vmachining.nc.heidenhain.contour import AXES
from vmachining.nc.heidenhain.coordinates import Coordinates
from vmachining.nc.heidenhain.text import TERM, spans, words
from vmachining.nc.model import ASSUMED_RPM, PenError, misread, refused

_SUB_CYCLE: Final = re.compile(r"CYCL\s+DEF\s*(\d{1,3})\s*\.\s*(\d{1,2})\s*(.*)")
_CYCLE: Final = re.compile(r"CYCL\s+DEF\s*(\d{1,3})\b\s*(.*)")
_VALUES: Final = re.compile(
    r"(Q\d{3,4})\s*=\s*([+-]?\s*(?:Q[LR]?\d+|\d+\.?\d*|\.\d+|MAX|FMAX|F?AUTO|F[UZ]\s*[\d.]*|PREDEF))(?![\d.A-PR-Z])"
)
_GARBLED: Final = re.compile(r"[^\s=]{0,20}\s*=\s*\S*|\bQ\d\S*")
"""What is left beside the name of a cycle and its values: a value that cannot be read."""
_TOOL: Final = re.compile(r'TOOL\s+CALL\s*("[^"]*"|Q[SLR]?\d+|\d+(?:\.\d+)?)?\s*([XYZUVW](?![A-Z]))?\s*(.*)')
_DELTA: Final = re.compile(rf"(DL|DR2|DR|VC|FZ|FU|S|F)\s*\(?\s*[:=]?\s*{TERM}")
_ROUND: Final = re.compile(rf"\b(RI|DI|R|D|L|DIST)\s*{TERM}")
_LAST: Final = re.compile(rf"(F?)\s*[A-Z .:-]*?\s*{TERM}\s*$")
_CUTTING: Final = ("Q206", "Q207", "Q385")
"""Feeds of cycles in material, for plunging, milling and finishing."""

_TCPM: Final = {
    "PATHCTRL VECTOR": "PATHCTRL AXIS", "AXIS SPAT": "AXIS POS",
    "REFPNT TIP-CENTER": "REFPNT TIP-TIP", "REFPNT CENTER-CENTER": "REFPNT TIP-TIP",
}  # fmt: skip
"""Variants that give words another meaning, and the one that is read."""

_MILLS: Final = spans("3-6 14 20-25 27 28 210-215 225-235 255 258-261 270-291")
"""Cycles for pockets, slots, studs, faces and contours that are not built."""


def _refused(number: int) -> PenError:
    what = MILLS if number in _MILLS else f"cycle {number} is not supported"
    return PenError("E208", what, f"CYCL DEF {number}", "post the motions of the cycle as blocks")


PLACING: Final = spans("400-406 408-419")
"""Touch probe cycles that set a basic rotation or a datum."""


class Definitions(Coordinates):
    """Definitions of a conversational program."""

    def _do_blk(self, text: str) -> None:
        found = re.match(r"BLK\s+FORM\s*(0\.[12]|CYLINDER|ROTATION|FILE)?\s*(.*)", text)
        kind = found[1] if found else None
        if found is None or kind not in ("0.1", "0.2", "CYLINDER"):
            what = f"BLK FORM {kind or ''}: accepted, the stock is that of the job"
            self.pen.note("I408", what, "BLK FORM", once="blk")
            return
        rest = found[2].strip()
        if kind == "CYLINDER":
            size = {key: self.q.number(value) * self.pen.scale for key, value in _ROUND.findall(rest)}
            radius, top = size.get("R", size.get("D", 0.0) / 2.0), size.get("DIST", 0.0)
            long = size.get("L", 0.0)
            if rest.startswith("Z") and radius > 0.0 and long > 0.0 and not {"RI", "DI"} & set(size):
                self.blank = {"cylinder": {"center": [0.0, 0.0], "radius": radius, "z": [top - long, top]}}
            return
        if kind == "0.1":
            self.stock = []
            rest = re.sub(r"^[XYZ]\s+", "", rest)
        given: dict[int, float] = {}
        for word in words(rest)[0]:
            if word.key in AXES:
                value = self.q.number(word.value) * self.pen.scale
                low = self.stock[0][1] if word.incremental and self.stock else {}
                given[AXES[word.key]] = value + low.get(AXES[word.key], 0.0)
        self.stock.append((kind, given))

    blank: dict[str, dict[str, Any]] | None = None

    def declared_stock(self) -> dict[str, dict[str, Any]] | None:
        """Stock that BLK FORM gives, as under [stock] of a job, mm."""
        if len(self.stock) == 2 and all(set(given) == {0, 1, 2} for _, given in self.stock):
            low, high = ([given[axis] for axis in range(3)] for _, given in self.stock)
            if all(x < y for x, y in zip(low, high, strict=True)):
                return {"box": {"min": low, "max": high}}
        return self.blank

    def _do_tool(self, text: str) -> None:
        if text.startswith("TOOL DEF"):
            self._tool_def(text)
            return
        found = _TOOL.fullmatch(text)
        if found is None:
            raise misread(text[:40])
        name, axis, rest = found[1], found[2], found[3]
        if axis not in (None, "Z"):
            raise refused(f"tool axis {axis}", axis, "post the program for tool axis Z")
        given = {key: self.q.number(value) for key, value in _DELTA.findall(rest)}
        pen = self.pen
        if name is not None:
            pen.change_tool(self._tool_number(name))
            pen.allowance = (0.0, 0.0)
            pen.spindle(0.0)
        if {"DL", "DR"} & set(given):
            pen.flush()
            pen.allowance = given.get("DL", 0.0) * pen.scale, given.get("DR", 0.0) * pen.scale
        if given.get("DR2"):
            raise refused("DR2, another corner radius,", "DR2")
        if given.get("VC", 0.0) > 0.0:
            given["S"] = self._speed_of(given["VC"])
        if "S" in given:
            if given["S"] < 0.0:
                raise PenError("E312", f"the spindle speed {given['S']:g} is negative", "S")
            self.speed = given["S"]
            if pen.rpm:
                pen.spindle(self.speed if pen.rpm > 0 else -self.speed)
        if "F" in given:
            self.tool_feed = given["F"] * pen.scale or None
            pen.feed, pen.feed_mode = self.tool_feed, "min"
        turned = given.get("FU", 0.0) or given.get("FZ", 0.0) * (pen.teeth() if "FZ" in given else 1)
        if turned:
            self.tool_feed = turned * pen.scale * self.speed or None
            pen.feed, pen.feed_mode = turned * pen.scale, "rev"

    def _speed_of(self, surface: float) -> float:
        """rev/min of a cutting speed in m/min (ft/min in inch)."""
        pen = self.pen
        radius = pen.radius() if pen.has_radius() else 0.0
        if radius <= 0.0:
            what = f"S(VC={surface:g}) of a tool whose radius is not known: timed at {ASSUMED_RPM:g} rev/min"
            pen.note("W381", what, "VC", once="vc")
            return ASSUMED_RPM
        return surface * (1000.0 if pen.scale == 1.0 else 12.0 * 25.4) / (math.tau * radius)

    speed = 0.0
    tool_feed: float | None = None
    """mm/min of the last TOOL CALL, which FAUTO means."""

    def _tool_number(self, name: str) -> int:
        if name.startswith('"'):
            return self.tool_of_name(name.strip('"').strip(), name)
        if name.startswith("QS"):
            if name not in self.q.texts:
                raise PenError("E108", f"{name} names the tool, and its text is not known", name)
            return self._tool_number(f'"{self.q.texts[name]}"')
        value = self.q.number(name)
        if value < 0.0:
            raise PenError("E322", f"tool {value:g}", name)
        return int(value)

    def _tool_def(self, text: str) -> None:
        found = re.match(r"TOOL\s+DEF\s*(\d+)(.*)", text)
        if found is None:
            return
        for key, value in re.findall(rf"\b([LR])\s*{TERM}", found[2]):
            number = self.q.number(value) * self.pen.scale
            if key == "R":
                self.pen.known_radius[int(found[1])] = number
            else:
                self.q.length[int(found[1])] = number / self.pen.scale

    def _do_stop(self, text: str) -> None:
        self._modes(self._read_words(text[4:].strip()), moves=False)

    def _do_cycl(self, text: str) -> None:
        if text.startswith("CYCL CALL"):
            self._cycle_call(text[9:].strip())
            return
        if (found := _SUB_CYCLE.match(text)) is not None:
            self._sub_cycle(int(found[1]), int(found[2]), found[3])
            return
        found = _CYCLE.match(text)
        if found is None:
            raise misread(text[:40])
        number = int(found[1])
        values: dict[str, float] = {}
        built = number in cycles.HOLES or number in milling.BUILT
        if built:
            self.cycle = (-number, values)  # not the one before, where a value of this one is refused
        for key, value in self._pairs(found[2], whole=built or number in (220, 221, 247)):
            values[key] = self._value(key, value)
            self.q.values[key] = values[key]
        if number == 247:
            self._preset(values.get("Q339", 0.0))
        elif number in (220, 221):
            self._pattern(number, values)
        elif built:
            self.cycle = (number, values)
        elif number in (32, 239, 332, 392) or 400 <= number < 500:
            self._lose_measured(number)
            word, once = f"CYCL DEF {number}", f"cycle {number}"
            if number in PLACING:
                what = f"cycle {number} sets the zero or the rotation of the part by probing: those in force are kept"
                hint = "set up the part on the machine as the program expects it, or leave the cycle out"
                self.pen.note("W368", what, word, once=once, hint=hint)
            else:
                self.pen.accept(once, word, once)
        elif number == 7:
            raise PenError("E109", "cycle 7 is not understood", text[:40])
        else:
            self.cycle = (-number, values)
            raise _refused(number)

    predefined: dict[str, float] | None = None
    """Of GLOBAL DEF, which PREDEF means."""

    def _value(self, key: str, text: str) -> float:
        """Value of a cycle parameter: a number, a feed by its kind, or one of GLOBAL DEF."""
        if text == "PREDEF":
            if self.predefined is None or key not in self.predefined:
                what = f"{key}=PREDEF, and no GLOBAL DEF gives it"
                raise PenError("E331", what, key, f"write the value of {key}")
            return self.predefined[key]
        if text in ("MAX", "FMAX") and key in _CUTTING:
            what = f"{key}={text}: a rapid is no feed into material"
            raise PenError("E301", what, key, f"write the feed of {key}")
        if text in ("AUTO", "FAUTO") and key in _CUTTING and not self.tool_feed:
            what = f"{key}={text} is the feed of the TOOL CALL, which has none"
            raise PenError("E301", what, key, f"write F in the TOOL CALL, or the feed of {key}")
        if text[0] in "AFM":
            feed = self.tool_feed or 0.0
            if text[:2] in ("FU", "FZ"):
                rate = float(text[2:] or 0.0) * (self.pen.teeth() if text[1] == "Z" else 1)
                return rate * (abs(self.pen.rpm) or self.speed)
            return feed / self.pen.scale if text.endswith("AUTO") else 0.0
        return self.q.number(text)

    def _do_global(self, text: str) -> None:
        """GLOBAL DEF: values that cycles take by PREDEF."""
        found = re.match(r"GLOBAL\s+DEF\s+\d{3}\b(.*)", text)
        if found is None:
            raise misread(text[:40])
        given = {key: self._value(key, value) for key, value in self._pairs(found[1])}
        self.predefined = {**(self.predefined or {}), **given}

    @staticmethod
    def _pairs(text: str, *, whole: bool = True) -> list[tuple[str, str]]:
        """Parameters of a cycle and their values; whole : refuse what is left over and looks like a value."""
        wrong = _GARBLED.search(_VALUES.sub(" ", text))
        if whole and wrong is not None:
            raise misread(wrong[0].strip())
        return [(key, value.replace(" ", "")) for key, value in _VALUES.findall(text)]

    def _do_preset(self, text: str) -> None:
        """PRESET SELECT #5 is cycle 247; KEEP TRANS leaves the transformations."""
        found = re.match(r"PRESET\s+SELECT\s*#?\s*(\d+|Q[LR]?\d+)(.*)", text)
        if found is None:
            what = f"{text[:40]} changes the table of presets"
            raise PenError("E208", what, text[:30], "set up the part in the job")
        self._preset(self.q.number(found[1]), keep="KEEP" in found[2])

    def _sub_cycle(self, number: int, part: int, rest: str) -> None:
        handler = getattr(self, f"_cycle_{number}", None)
        if handler is not None:
            if part == 1 or (part and number != 19):
                handler(rest)
            return
        if part != 0:
            if self.cycle is not None and self.cycle[0] in (number, -number) and number in cycles.OLD:
                bare = _LAST.findall(rest)
                if not bare and rest.strip() == "DWELL":
                    bare = [("", "0")]
                if not bare:
                    raise PenError("E109", f"'{rest[:40]}' of cycle {number} is not understood", rest[:40])
                self.cycle[1][str(part)] = self.q.number(bare[0][1])
            return
        if number in cycles.OLD:
            self.cycle = (number, {})
        elif number in (13, 32):
            self.pen.accept(f"cycle {number}", f"CYCL DEF {number}", f"cycle {number}")
        else:
            self.cycle = (-number, {})
            raise _refused(number)

    def _cycle_9(self, rest: str) -> None:
        found = re.findall(TERM, rest)
        if not found:
            raise PenError("E335", "cycle 9 without a time", rest[:20])
        self.pen.dwell(max(0.0, self.q.number(found[-1])))

    def _cycle_12(self, rest: str) -> None:
        self.selected = re.sub(r"^PGM\s*", "", rest)
        self.cycle = (12, {})

    def _do_function(self, text: str) -> None:
        if re.match(r"FUNCTION\s+RESET\s+TCPM", text):
            self.pen.set_tcp(False)
        elif re.match(r"FUNCTION\s+TCPM\b", text):
            for wrong, right in _TCPM.items():
                if wrong in text:
                    raise refused(f"FUNCTION TCPM with {wrong}", wrong, f"post it with {right}")
            self.pen.set_tcp(True)
        elif (wait := re.match(r"FUNCTION\s+DWELL\s+(TIME|REV)\s*(\S+)", text)) is not None:
            value = self.q.number(wait[2])
            turns = abs(self.pen.rpm)
            self.pen.dwell(value if wait[1] == "TIME" else 60.0 * value / turns if turns else 0.0)
        elif re.match(r"FUNCTION\s+(?:MODE\s+(?:MILL|SET)|FEED|S-PULSE|PROG\s+PATH|DCM|COUNT|FILE|LIFTOFF|PARAXCOMP|"
                      r"CORRDATA\s+RESET|RESET\s+\w+)", text):  # fmt: skip
            self.pen.note("I408", f"{text[:30]} moves nothing: accepted", text[:20], once=text[:20])
        elif re.match(r"FUNCTION\s+(?:AFC|ACC)\b", text):
            what = "FUNCTION AFC adapts feeds while it cuts: the feeds here ignore it"
            self.pen.note("W376", what, "FUNCTION", once="AFC")
        else:
            raise refused(f"{text[:40]}", text[:30])

    def _do_tch(self, text: str) -> None:
        found = re.match(r"TCH\s+PROBE\s+(\d+)", text)
        self._lose_measured(int(found[1][:4]) if found else 0)
        self.pen.note("I408", f"{text[:14]} cuts nothing: accepted", text[:9], once=text[:14])

    def _lose_measured(self, number: int) -> None:
        """Results of touch probe cycles (Q115 to Q119, Q150 to Q199) only the machine knows."""
        if number in (0, 1) or 400 <= number < 500:
            for k in (*range(115, 120), *range(150, 200)):
                self.q.lose(f"Q{k}", f"what touch probe cycle {number} measured")

    def _preset(self, number: float, *, keep: bool = False) -> None:
        if not keep:  # datum shift, mirror, rotation and scales end with it, a tilted plane does not
            self._replan(self.planes.reset)
            self.rotation = 0.0
        if self.preset is not None and number != self.preset:
            what = (
                "a second preset: its distance from the first is not given; both are assumed to be the same"
            )
            self.pen.note("W368", what, "CYCL DEF 247", once=f"{number:g}")
        self.preset = number
        self.pen.note("I409", f"preset {number:g} is the zero of the job", "CYCL DEF 247", once="preset")

    def _pattern(self, number: int, values: dict[str, float]) -> None:
        if self.cycle is None:
            what = f"cycle {number} calls the cycle defined before it, and none exists"
            raise PenError("E340", what, "CYCL DEF")
        kind, own = self.cycle
        if kind < 0:
            return  # refused when it was defined
        if kind not in cycles.HOLES and kind not in milling.BUILT:
            raise refused(f"a pattern of cycle {kind}", "CYCL DEF")
        own = {**own, **{k: v for k, v in values.items() if k in ("Q200", "Q203", "Q204")}}
        pen, k = self.pen, self.pen.scale
        up = own.get("Q203", 0.0) + max(own.get("Q204", 0.0), own.get("Q200", 0.0))
        between = own | ({"Q204": 0.0} if values.get("Q301", 1.0) == 0.0 else {})
        spots = cycles.points(number, values)
        if pen.at[2] < up * k:
            pen.go({2: up * k}, rapid=True)
        for place, spot in enumerate(spots):
            pen.go({0: spot.x * k, 1: spot.y * k}, rapid=True)
            self._act(kind, own if place == len(spots) - 1 else between)

    spots: list[cycles.Spot] | None = None

    def _do_pattern(self, text: str) -> None:
        self.spots = cycles.defined(re.sub(r"^PATTERN\s+DEF\s*", "", text), self.q.number)

    def _call_at_points(self) -> None:
        """CYCL CALL PAT: between the points the tool is at Q204, or where it stands if that is higher."""
        pen, k = self.pen, self.pen.scale
        if self.cycle is not None and self.cycle[0] < 0:
            return  # refused when it was defined
        if self.spots is None:
            raise PenError("E208", "CYCL CALL PAT without PATTERN DEF: a table of points is not given here", "CYCL CALL PAT",
                           "call the cycle by M99 at each point")  # fmt: skip
        high = pen.at[2]
        for spot in self.spots:
            if pen.at[2] < high:
                pen.go({2: high}, rapid=True)
            pen.go({0: spot.x * k, 1: spot.y * k}, rapid=True)
            self._run_cycle(spot.z * k)

    def _cycle_call(self, rest: str) -> None:
        surface = 0.0
        if rest.startswith("PAT"):
            self._modes(self._read_words(rest[3:].strip()), moves=False)
            self._call_at_points()
            return
        if rest.startswith("POS"):
            found = self._read_words(rest[3:].strip())
            self._modes([w for w in found if w.key in ("M", "F", "FMAX")], moves=True)
            given, _ = self.contour.target(found)
            surface = given.pop(2, 0.0)
            self.pen.go(given, rapid=self.rapid)
        else:
            self._modes(self._read_words(rest), moves=False)
        self._run_cycle(surface)

    def _run_cycle(self, surface: float = 0.0) -> None:
        if self.cycle is None:
            raise PenError("E340", "a cycle is called, and none was defined", "M99")
        number, values = self.cycle
        if number == 12:
            self._call_file(self.selected)
        elif number > 0:
            self._act(number, values, surface)

    def _act(self, number: int, values: dict[str, float], surface: float = 0.0) -> None:
        if number in milling.BUILT:
            milling.milled(self.pen, number, values, surface)
        else:
            cycles.drill(self.pen, number, values, surface=surface)
