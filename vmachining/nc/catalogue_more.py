"""More of the catalogue: tables, cycles, cutter compensation, coordinates, control flow."""

from __future__ import annotations

from typing import Final

from vmachining.nc.catalogue_entry import Entry

MORE: Final[dict[str, Entry]] = {
    "E109": Entry(
        "record not understood",
        "The record or row does not follow the format.",
        "check the file and the dialect",
    ),
    # ---- cycles, patterns ----
    "E331": Entry(
        "cycle without depth",
        "The first block of a canned cycle needs the word of the drilling axis (Z in G17, Y in G18, X "
        "in G19); in dialect mts every stored cycle needs Z.",
        "program the depth",
    ),
    "E332": Entry(
        "cycle without clearance plane",
        "The first block of a canned cycle needs R. In dialect mts, R of a circular pattern is its "
        "radius, above zero.",
        "program R",
    ),
    "E333": Entry(
        "clearance plane below the bottom",
        "R must not lie below the bottom of the hole; in G91 the depth is measured from R and must not be positive.",
        "check the signs of R and of the depth",
    ),
    "W333": Entry(
        "clearance plane below the bottom",
        "The tool goes down to R by a rapid, through the part where it is still there, and cuts upwards to Z. Controls "
        "of the Fanuc family execute it as it stands; posts that count R from the surface mean something else.",
        "check R and Z",
    ),
    "E334": Entry(
        "no peck depth",
        "G73 and G83 drill in steps of Q, which must be above zero.",
        "program Q",
    ),
    "E335": Entry(
        "bad dwell",
        "G4, and the cycles G82, G86 and G89 in their first block, need P: a time in seconds, zero or more.",
        "program P",
    ),
    "W335": Entry(
        "long dwell",
        "P of G4 and of canned cycles counts seconds, as on the open reference control. Fanuc and controls like it "
        "count milliseconds: their G4 P1000, one second, is read here as more than a quarter of an hour.",
        'if the post means milliseconds, set dwell = "ms" under [program], or --dwell ms',
    ),
    "E336": Entry(
        "bad number of repetitions",
        "L counts holes or calls: it must be a whole number, at least one for holes.",
        "make L whole, or remove it",
    ),
    "E337": Entry(
        "depth points upwards",
        "Z of a stored cycle (dialect mts) is a step down from the clearance plane, so it is negative.",
        "check the sign of Z",
    ),
    "E338": Entry(
        "negative withdrawal",
        "W of a stored cycle (dialect mts) is the distance up from the clearance plane.",
        "check the sign of W",
    ),
    "E339": Entry(
        "bad step",
        "G82 and G83 (dialect mts) need K above zero; D and B must not be negative, and a hole has fewer than a "
        "hundred thousand steps.",
        "check K, D and B",
    ),
    "E340": Entry(
        "nothing to call",
        "G79 calls the cycle stored before it, but no cycle is stored.",
        "program G81, G82 or G83 first",
    ),
    "E341": Entry(
        "pattern without cycle",
        "G79 finds a pattern of points, but no stored cycle to repeat at them.",
        "program G81, G82 or G83 first",
    ),
    "E342": Entry(
        "bad number of points",
        "S of a pattern (dialect mts) counts its points: it must be a whole number, one or more.",
        "program S",
    ),
    "E343": Entry(
        "all points at one position",
        "A pattern of more than one point needs a spacing D that is not zero.",
        "program D",
    ),
    "E344": Entry(
        "cycle under cutter compensation",
        "Holes have no left or right side.",
        "program G40 before the cycle",
    ),
    "W345": Entry(
        "tap misses its hole",
        "In G18 and G19 the reference control swaps the coordinates of the hole for taps (G84, G74). This is an "
        "error of that control; the moves here reproduce it.",
        'tap in G17, or read the program with taps = "axis", which feeds along the axis of the plane',
    ),
    # ---- cutter compensation ----
    "E351": Entry(
        "tool radius unknown",
        "Cutter compensation needs the diameter of the tool, from the tool table through D or the tool in "
        "the spindle; G41.1 and G42.1 contain it.",
        "give a tool table, or use G41.1 D...",
    ),
    "W351": Entry(
        "compensation without a tool",
        "The radius of the tool is unknown, or D0 refers to an empty spindle: the programmed path is used without offset.",
        "give the diameter of the tool in a tool table or in the job",
    ),
    "E352": Entry(
        "compensation starts or ends on an arc",
        "The move from the programmed path to the offset path must be a straight line; with entry rule prev "
        "it may be an arc if a circle tangent to the offset path exists.",
        "enter and leave on a straight line",
    ),
    "E353": Entry(
        "entry too short",
        "The first move under compensation must not be shorter than the tool radius.",
        "start farther away",
    ),
    "W353": Entry(
        "entry against the first cut",
        "The entry move points against the first cut, so the tool moves around the end of the entry "
        "move at full depth.",
        "enter in the direction of the cut, or use the entry rule next",
    ),
    "E354": Entry(
        "arc smaller than the tool",
        "On the inside of an arc, its radius must be greater than that of the tool.",
        "use a smaller tool",
    ),
    "E355": Entry(
        "gouge",
        "The tool cannot reach an inner corner: the offset paths do not meet, or a segment would run backwards.",
        'use a smaller tool, open the corner, or enter as other controls do: crc_entry = "next" under [program]',
    ),
    "W355": Entry(
        "tool cuts into a neighbouring segment",
        "Compensated as programmed, the tool cuts into the segment before or after the current "
        "one, away from their corner: an arc that curls back, an entry from the wrong side, or a "
        "path that turns back by nearly 180 degrees. Controls give no warning.",
        "use a smaller tool, or check the side of the compensation",
    ),
    "E356": Entry(
        "plane change under compensation",
        "Left and right are defined in one plane.",
        "program G40 first",
    ),
    "E357": Entry(
        "compensation is on already",
        "G41 and G42 start from G40.",
        "program G40 first",
    ),
    "W358": Entry(
        "end with compensation on",
        "The program ends without G40; the last move stops one tool radius away from its programmed end.",
        "program G40 on the retract move",
    ),
    "E359": Entry(
        "change of zero, units or tool under compensation",
        "The offset path depends on the moves before, so work offsets, G92, units, tool and "
        "reference points must not change.",
        "program G40 first",
    ),
    # ---- coordinates and axes ----
    "E361": Entry(
        "not in a main plane",
        "An arc must lie in XY, ZX or YZ. A rotated work offset tilts the last two; in "
        "a cutter location file the axis of a circle must be X, Y or Z.",
        "post the arc as short lines",
    ),
    "E362": Entry(
        "polar words without a direction",
        "An angle that is not programmed, or a step in G91, is measured from the direction of the tool as seen from "
        "the origin of the work offset; at the origin itself there is no direction.",
        "program ^ in G90",
    ),
    "E363": Entry(
        "tool axis without length",
        "The vector of the tool axis is zero.",
        "check the row",
    ),
    "W363": Entry(
        "tool axis not of length one",
        "The vector differs from unit length by more than its printed digits explain; its direction is used.",
        "normalise the vector",
    ),
    "E364": Entry(
        "tool axis reversed",
        "From one pose to the next the axis turns by 180 degrees, in no particular direction.",
        "insert a pose between them",
    ),
    "W364": Entry(
        "tilt without MULTAX",
        "The file tilts the tool without MULTAX.",
        "add MULTAX/ON",
    ),
    "E373": Entry(
        "beyond the travel",
        "A target lies outside the travel of the machine.",
        "move the part or choose another machine",
    ),
    "I374": Entry(
        "between the increments",
        "Some targets are not multiples of the smallest step of the machine; it moves to the nearest multiple.",
    ),
    "E375": Entry(
        "bad offset",
        "G10 takes L2 or L20 with P 0 for the active work offset, 1 to 9 for G54 to G59.3; or L1, L10 or "
        "L11 with P, the number of a tool.",
        "check L and P",
    ),
    "E376": Entry(
        "incomplete M code",
        "M19, M62 to M68 and M72 do not change the path, but a number that they need is missing or outside its range, or "
        "there is nothing to restore.",
        "check the words of the M code",
    ),
    "W377": Entry(
        "feed beyond the machine",
        "The feed lies outside the range of the machine, or one of its axes would have to move faster than it can. Most "
        "controls clamp it, so the chip load differs from the planned one.",
        "program a feed within the range of the machine, or choose another machine",
    ),
    "E377": Entry(
        "legs beyond their reach",
        "A leg of the hexapod head would be too long or too short, or one of its joints would lean too far.",
        "move the part, lean the tool less, or choose another machine",
    ),
    "W378": Entry(
        "spindle speed beyond the machine",
        "The spindle cannot turn as slowly or as fast as the program asks. Most controls clamp it, so that the feed per "
        "tooth differs.",
        "program a speed within the range of the spindle, and the matching feed",
    ),
    "E378": Entry(
        "path that the machine cannot take",
        "The program needs axes that the machine does not have, or a feed that is not given anywhere.",
        "choose a machine with these axes",
    ),
    "W520": Entry(
        "nothing is cut",
        "All feed motions lie above the stock.",
        "check Z, and the work offset",
    ),
    # ---- control flow ----
    "E411": Entry(
        "control structure",
        "O words must pair by label and nest: sub endsub, if elseif else endif, while "
        "endwhile, do while, repeat endrepeat. The lines of a broken pair have no effect.",
        "close the structure with the same label",
    ),
    "W411": Entry(
        "program number used twice",
        "Two O numbers of this file are equal except for leading zeros; M98 calls the first one.",
        "give them different numbers",
    ),
    "E412": Entry(
        "unknown subprogram",
        "This file does not contain the called label, and there is no file NAME.ngc next to it or in the given folders. M98 "
        "calls program numbers, call calls the labels of sub.",
        "add the subprogram to the file",
    ),
    "E413": Entry(
        "endless loop",
        "Loops and calls repeated so many lines that the program probably never ends; the rest "
        "is not examined.",
        "check the condition of the loop, or raise max_steps under [program], or --max-steps",
    ),
    "E414": Entry(
        "calls nested too deep",
        "A subprogram probably calls itself endlessly; the rest is not examined.",
        "add a condition that ends the recursion",
    ),
    "E415": Entry(
        "return without call",
        "return, endsub and M99 return to a call, but there was no call; or a call never returns.",
        "end the main program with M30 before its subprograms",
    ),
    "W415": Entry(
        "main program repeats",
        "M99 in the main program repeats it from its start, for machines that load parts automatically. "
        "It is read once.",
        "end the program with M30, and the subprograms after it",
    ),
    "E416": Entry(
        "values in brackets",
        "if, elseif, while and repeat take one value in brackets, call takes up to thirty, return and "
        "endsub at most one.",
        "write for example o100 if [#1 GT 2]",
    ),
    "E418": Entry(
        "the program aborts",
        "The program reached a comment (ABORT, ...): the reference control stops there with an error, and reading "
        "stops too.",
        "find out why the program reached this line",
    ),
    "E417": Entry(
        "restart not possible",
        "The program never reaches the restart line, or cutter compensation is on there.",
        "restart at another line",
    ),
    # ---- Heidenhain, Sinumerik, Fanuc ----
    "I408": Entry(
        "accepted, without motion",
        "The control does something here that does not affect the path: coolant, clamps, look-ahead, tolerances, messages. "
        "Reported once for each code.",
    ),
    "I409": Entry(
        "preset taken as zero",
        "The program calls a datum of the machine's table. The job uses the coordinates of this datum.",
    ),
    "W365": Entry(
        "swing of the tool",
        "While rotary axes turn the part and the slides are at rest, the tip swings around it; how far depends on the machine. "
        "An arc about the zero of the job is assumed; from the first position in the new plane the path is exact again.",
        "retract before the plane is tilted, or set home well above the part",
    ),
    "W366": Entry(
        "machine coordinates without a machine",
        "Machine coordinates are positions of the slides. The job does not give the position of the part on the machine, so "
        "the named axes move to home, where the tool started; X and Y of G53 are taken as part coordinates.",
        "give the position of the part as a work offset, or set home above the part",
    ),
    "W367": Entry(
        "tool by name",
        "The program calls tools by name; the job numbers them in the order of their calls.",
        "number the [[tools]] of the job in this order",
    ),
    "E367": Entry(
        "order of transformations",
        "A shift, mirror, rotation or scale is redefined while a later one is active. The manuals leave "
        "open which of the two then acts first.",
        "cancel the later one first",
    ),
    "E368": Entry(
        "motions under G500 and an offset",
        "The program moves under the base coordinate system (G500) and under a settable offset, but the distance between them "
        "is unknown.",
        "split the program, or program the shift",
    ),
    "W369": Entry(
        "tool axis in a turned frame",
        "Under tool centre point control the rotary axes are not at zero and ROT or AROT has tilted the frame. The tool is "
        "assumed to point along Z of that frame, as posts arrange it; the angles of the machine are not checked.",
        "program the plane with CYCLE800",
    ),
    "W370": Entry(
        "feeds under G70",
        "G70 changes the unit of lengths but not of feeds, which stay in the unit of the machine. That is assumed to be inch.",
        "use G700, which changes both",
    ),
    "W371": Entry(
        "motion code missing",
        "Coordinates before any of G0, G1, G2, G3: machine data decide which of them is active at the start.",
        "write G0 or G1 into the block",
    ),
    "W372": Entry(
        "feed of plunging moves",
        "M103 lowers the feed of plunging moves. Here they keep the programmed feed, so they take longer on the machine.",
        "program the feeds in the moves",
    ),
    "W373": Entry(
        "cycle that moves along its own path",
        "The manual leaves a part of the path of this cycle open, or the spindle does not turn there. The finding states what "
        "is assumed.",
        "post the motions of the cycle as separate blocks",
    ),
    "W374": Entry(
        "plane by an angle of the machine",
        "PLANE AXIAL gives angles of machine axes. A alone is assumed to turn about X and B alone about Y, as in ISO 841.",
        "post it as PLANE SPATIAL",
    ),
    "W375": Entry(
        "tool axis between two vectors",
        "Under ORIAXES and ORIMKS the rotary axes turn evenly from one tool axis to the next, which depends on the machine. The "
        "great circle between the two is used instead.",
        "post A B C in place of A3 B3 C3, or ORIVECT",
    ),
    "W368": Entry(
        "second work offset without a position",
        "The program cuts in two work offsets, and the distance between them is unknown. Both are assumed to be at the same "
        "position, so the cuts of the second coincide with those of the first. In G code, where some offsets "
        "are given, the others count as zero.",
        "give all work offsets of the program: work_offsets = { G54 = [0, 0, 0], G55 = [120, 0, 0] } under [program]",
    ),
    "W379": Entry(
        "passes that a cycle makes by itself",
        "The control divides this cycle into passes of its own. They are left out: the tool stays where the cycle ends. For "
        "turning, the contour that it works towards is read where the program finishes it; a milling cycle is left out "
        "only where the radius of its tool is not known. No job runs a program whose passes are left out.",
        "give the tool in the job, or post the passes as single motions",
    ),
    "W380": Entry(
        "a program for turning",
        "Its path is read, checked and drawn: radius over Z, in the plane Y = 0. Turning removes no material here, so no job "
        "runs it.",
        'confirm what X words are: lathe = "diameter" under [program.control], or --control',
    ),
    "W381": Entry(
        "feed per turn without a speed",
        "G95 and taps count the feed in turns of the spindle, and no S tells how fast these are, or no pitch how far they lead; "
        "FZ needs the teeth of the tool, VC its radius. The path is right; times, chips and forces are those of a guess: 1000 "
        "rev/min, a pitch of 1 mm, 2 teeth.",
        "give the speed by S, the pitch in the cycle",
    ),
    "W382": Entry(
        "a macro of the builder",
        "Macros O9000 to O9999, called by G65 or G66, come with the machine, for tool changes, probes, breakage and pallets. "
        "This one is not here, and is taken to move nothing that cuts.",
        "put it beside the program if it cuts",
    ),
    "W383": Entry(
        "a program that is missing",
        "The call is left out and the rest is read. Where the tool is after it is taken to be where it was before; a job does "
        "not run without the program.",
        "put the program beside this one or name its folder; an empty one will do where it moves nothing",
    ),
    "W384": Entry(
        "a milling cycle of the control",
        "The shape that it leaves, its depths, allowances and sense are those of the manual. Where the passes that clear it lie "
        "is the control's own; those here run parallel to the wall. The finished shape and its volume hold; chips, forces and "
        "times of the clearing are those of our passes. Inner corners that are smaller than the tool keep its radius.",
        "post the passes as single motions where they matter",
    ),
    "W376": Entry(
        "feeds by an override of the program",
        "OVR, OVRA, FL, FA and VELOLIM change or limit the feed of the path or of single axes. The path is right, but feeds "
        "follow F alone, so times, chips and forces are those at 100 %.",
        "program the feed with F",
    ),
}
