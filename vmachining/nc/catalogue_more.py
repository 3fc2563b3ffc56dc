"""More of the catalogue: tables, cycles, cutter compensation, coordinates, control flow."""

from __future__ import annotations

from typing import Final

from vmachining.nc.catalogue_entry import Entry

__all__ = ["MORE"]

MORE: Final[dict[str, Entry]] = {
    "E109": Entry(
        "record not understood",
        "The record or row is not written as the format has it.",
        "check the file and the dialect",
    ),
    # ---- cycles, patterns ----
    "E331": Entry(
        "cycle without depth",
        "The first block of a canned cycle needs the word of the drilling axis (Z in G17, Y in G18, X "
        "in G19), in dialect mts every stored cycle needs Z.",
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
        "R must not lie below the bottom of the hole; in G91 the depth counts from R and is not positive.",
        "check the signs of R and of the depth",
    ),
    "E334": Entry(
        "no peck depth",
        "G73 and G83 go down in steps of Q, above zero.",
        "program Q",
    ),
    "E335": Entry(
        "bad dwell",
        "A dwell needs P, in seconds, zero or more: G4, and the cycles G82, G86 and G89 in their "
        "first block.",
        "program P",
    ),
    "W335": Entry(
        "long dwell",
        "P of G4 and of canned cycles counts seconds, as on the open reference control. Fanuc and controls like it "
        "count milliseconds, so that their G4 P1000, one second, is read as more than a quarter of an hour.",
        'if the post means milliseconds: dwell = "ms" under [program], or --dwell ms',
    ),
    "E336": Entry(
        "bad number of repetitions",
        "L counts holes or calls: a whole number, for holes one or more.",
        "make L whole, or remove it",
    ),
    "E337": Entry(
        "depth upwards",
        "Z of a stored cycle (dialect mts) is a step down from the clearance plane, so it is negative.",
        "check the sign of Z",
    ),
    "E338": Entry(
        "negative withdrawal",
        "W of a stored cycle (dialect mts) is the way up from the clearance plane.",
        "check the sign of W",
    ),
    "E339": Entry(
        "bad step",
        "G82 and G83 (dialect mts) need K above zero; D and B are not negative, and no hole takes a "
        "hundred thousand steps.",
        "check K, D and B",
    ),
    "E340": Entry(
        "nothing to call",
        "G79 calls the cycle stored before it, and none exists.",
        "program G81, G82 or G83 first",
    ),
    "E341": Entry(
        "pattern without cycle",
        "G79 finds a pattern of points, but no stored cycle to repeat there.",
        "program G81, G82 or G83 first",
    ),
    "E342": Entry(
        "bad number of points",
        "S of a pattern (dialect mts) counts its points: a whole number, one or more.",
        "program S",
    ),
    "E343": Entry(
        "points at one place",
        "A pattern of more than one point needs a spacing D that is not zero.",
        "program D",
    ),
    "E344": Entry(
        "cycle under cutter compensation",
        "Holes have no left or right side.",
        "program G40 before the cycle",
    ),
    "W345": Entry(
        "tap beside its hole",
        "In G18 and G19 the reference control sends taps (G84, G74) to the coordinates of the hole in "
        "another order. That is an error of that control; the moves here are the ones it makes.",
        'tap in G17, or read the program with taps = "axis", which feeds along the axis of the plane',
    ),
    # ---- cutter compensation ----
    "E351": Entry(
        "tool radius unknown",
        "Cutter compensation needs the diameter of the tool: from the tool table, by D or the tool in "
        "the spindle; G41.1 and G42.1 say it themselves.",
        "give a tool table, or use G41.1 D...",
    ),
    "W351": Entry(
        "compensation without a tool",
        "The radius of the tool is not known, or D0 names the tool of an empty spindle: the path is taken as it is programmed.",
        "give the tool its diameter by a tool table or in the job",
    ),
    "E352": Entry(
        "compensation starts or ends on an arc",
        "The way from the programmed path to the offset path is a straight line; with entry rule prev "
        "an arc may be one if a circle tangent to the offset path exists.",
        "enter and leave on a straight line",
    ),
    "E353": Entry(
        "entry too short",
        "The first move under compensation must not be shorter than the tool radius.",
        "start farther away",
    ),
    "W353": Entry(
        "entry against the first cut",
        "The entry move points against the first cut, so the tool goes round the end of the entry "
        "move at depth.",
        "enter in the direction of the cut, or use the entry rule next",
    ),
    "E354": Entry(
        "arc smaller than the tool",
        "On its inner side the radius of an arc must be greater than that of the tool.",
        "take a smaller tool",
    ),
    "E355": Entry(
        "gouge",
        "An inner corner cannot be reached: the offset paths do not meet, or a piece would run backwards.",
        'take a smaller tool, open the corner, or enter as other controls do: crc_entry = "next" under [program]',
    ),
    "W355": Entry(
        "tool over its neighbour",
        "Compensated as programmed, the tool cuts into the segment before or after the one that it "
        "follows, away from their corner: an arc that curls back, an entry from the wrong side, or a "
        "path that turns back by nearly 180 degrees. Controls do it without a word.",
        "take a smaller tool, or check the side of the compensation",
    ),
    "E356": Entry(
        "plane change under compensation",
        "Left and right are sides in one plane.",
        "program G40 first",
    ),
    "E357": Entry(
        "compensation is on already",
        "G41 and G42 start from G40.",
        "program G40 first",
    ),
    "W358": Entry(
        "end with compensation on",
        "The program ends without G40; the last move stops beside its programmed end.",
        "program G40 on the way out",
    ),
    "E359": Entry(
        "change of zero, units or tool under compensation",
        "The offset path depends on what was there before, so work offsets, G92, units, tool and "
        "reference points must not change.",
        "program G40 first",
    ),
    # ---- coordinates and axes ----
    "E361": Entry(
        "not in a main plane",
        "An arc lies in XY, ZX or YZ. A rotated work offset turns the last two out of their place; in "
        "a cutter location file the axis of a circle must be X, Y or Z.",
        "post the arc as short lines",
    ),
    "E362": Entry(
        "polar words without a direction",
        "An angle that is not programmed, or a step in G91, counts from the direction in which the tool "
        "stands; at the origin of the work offset none exists.",
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
        "put a pose between",
    ),
    "W364": Entry(
        "tilt without MULTAX",
        "The file tilts the tool although it never said MULTAX.",
        "MULTAX/ON",
    ),
    "E373": Entry(
        "beyond the travel",
        "A target lies outside the travel of the machine.",
        "move the part or choose another machine",
    ),
    "I374": Entry(
        "between the increments",
        "Some targets are not multiples of the smallest step of the machine; it goes to the nearest.",
    ),
    "E375": Entry(
        "bad offset",
        "G10 takes L2 or L20, and P: 0 for the work offset in force, 1 to 9 for G54 to G59.3; or L1, L10 or "
        "L11, and P, the number of a tool.",
        "check L and P",
    ),
    "E376": Entry(
        "incomplete M code",
        "M19, M62 to M68 and M72 change no path, but a number that they need is missing or outside its range, or "
        "there is nothing to bring back.",
        "check the words of the M code",
    ),
    "W377": Entry(
        "feed beyond the machine",
        "The feed lies outside the range of the machine, or one of its axes would have to go faster than it can. Most "
        "controls clamp it, so that chips differ from those that were planned.",
        "write a feed that the machine has, or another machine",
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
        "write a speed that the spindle has, and the feed that belongs to it",
    ),
    "E378": Entry(
        "path that the machine cannot take",
        "The program needs axes that the machine does not have, or a feed that nobody names.",
        "choose a machine with these axes",
    ),
    "W520": Entry(
        "nothing is cut",
        "All feed motions lie above the stock.",
        "check Z, and the work offset",
    ),
    # ---- what steers ----
    "E411": Entry(
        "control structure",
        "O words pair by label and lie within each other: sub endsub, if elseif else endif, while "
        "endwhile, do while, repeat endrepeat. The lines of a broken pair steer nothing.",
        "close the structure with the same label",
    ),
    "W411": Entry(
        "program number used twice",
        "Two O numbers of this file are equal but for zeros in front; M98 calls the first of them.",
        "number them apart",
    ),
    "E412": Entry(
        "unknown subprogram",
        "Nothing in this file has the label called, and no file NAME.ngc beside it or in the folders given; M98 "
        "calls program numbers, call the labels of sub.",
        "put the subprogram into the file",
    ),
    "E413": Entry(
        "no end in sight",
        "Loops and calls repeated so many lines that the program is taken to run for ever; the rest "
        "is not examined.",
        "check the condition of the loop, or raise max_steps: under [program], or --max-steps",
    ),
    "E414": Entry(
        "calls nested too deep",
        "A subprogram probably calls itself without end; the rest is not examined.",
        "let the recursion end",
    ),
    "E415": Entry(
        "return without call",
        "return, endsub and M99 go back to a call, and here was none; or a call never comes back.",
        "end the main program with M30 before its subprograms",
    ),
    "W415": Entry(
        "main program repeats",
        "M99 in the main program sends it back to its start, for machines that load parts by themselves. "
        "It is read once.",
        "end the program with M30, and the subprograms after it",
    ),
    "E416": Entry(
        "values in brackets",
        "if, elseif, while and repeat take one value in brackets, call up to thirty, return and "
        "endsub one at most.",
        "o100 if [#1 GT 2]",
    ),
    "E418": Entry(
        "the program gives up",
        "A comment (ABORT, ...) was reached: the reference control stops there with an error, and so does the "
        "reading.",
        "see why the program came to this line",
    ),
    "E417": Entry(
        "restart not possible",
        "The program never comes to the line where it was to restart, or cutter compensation is on there.",
        "restart at another line",
    ),
    # ---- dialects with words of their own ----
    "I408": Entry(
        "accepted, moves nothing",
        "The control does something here that no path depends on: coolant, clamps, look-ahead, tolerances, messages. "
        "Reported once for each code.",
    ),
    "I409": Entry(
        "preset taken as zero",
        "The program calls a datum of the machine's table. The coordinates of the job are those of this datum.",
    ),
    "W365": Entry(
        "swing of the tool",
        "While rotary axes turn the part and the slides rest, the tip swings around it, how far depends on the machine. "
        "It is taken on an arc about the zero of the job; the first positions in the new plane are exact again.",
        "retract before the plane is tilted, or put home well above the part",
    ),
    "W366": Entry(
        "machine coordinates without a machine",
        "Machine coordinates say where the slides are. The job does not say where the part lies there, so the axes named "
        "go to home, where the tool started; X and Y of G53 are taken as those of the part.",
        "give the place of the part as a work offset, or set home above the part",
    ),
    "W367": Entry(
        "tool by name",
        "The program calls tools by name; jobs number them, in the order in which the program calls them.",
        "number the [[tools]] of the job like this",
    ),
    "E367": Entry(
        "order of transformations",
        "A shift, mirror, rotation or scale is defined anew while one that came after it is in force. The manuals leave "
        "open which of the two then acts first.",
        "cancel the later one before",
    ),
    "E368": Entry(
        "second preset",
        "The program goes from one datum of the machine's table to another, and nothing here tells how far they are apart.",
        "split the program, or write the shift into it",
    ),
    "W369": Entry(
        "tool axis in a turned frame",
        "Under tool centre point control the rotary axes stand turned and ROT or AROT has tilted the frame. The tool is taken "
        "to stand along Z of that frame, as posts arrange it; whether the angles of the machine bring it there is not known.",
        "write the plane as CYCLE800",
    ),
    "W370": Entry(
        "feeds under G70",
        "G70 changes the unit of lengths and not that of feeds, which is the unit of the machine. It is taken to be inch.",
        "G700 changes both",
    ),
    "W371": Entry(
        "motion code missing",
        "Coordinates before any of G0, G1, G2, G3: which of them holds at the start is for the data of the machine.",
        "write G0 or G1 into the block",
    ),
    "W372": Entry(
        "feed of plunging moves",
        "M103 lowers the feed of moves that plunge. They keep the programmed feed here: they take longer on the machine.",
        "write the feeds into the moves",
    ),
    "W373": Entry(
        "cycle that moves along its own path",
        "The manual does not measure a part of the way of this cycle, or its tool does not turn there. What is taken is said.",
        "post the motions of the cycle as blocks",
    ),
    "W374": Entry(
        "plane by an angle of the machine",
        "PLANE AXIAL names angles of the machine's axes. A alone is taken to turn about X and B alone about Y, as ISO 841 "
        "names them.",
        "post it as PLANE SPATIAL",
    ),
    "W375": Entry(
        "tool axis between two vectors",
        "Under ORIAXES and ORIMKS the rotary axes go evenly from one tool axis to the next, which depends on the machine. The "
        "great circle between the two is taken.",
        "post A B C in place of A3 B3 C3, or ORIVECT",
    ),
    "W368": Entry(
        "second work offset without a place",
        "The program cuts in two work offsets, and nothing says how far one lies from the other. Both are taken to be the same "
        "place: what is cut in the second one falls onto the first.",
        "give all work offsets of the program: work_offsets = { G54 = [0, 0, 0], G55 = [120, 0, 0] } under [program]",
    ),
    "W379": Entry(
        "passes that a cycle makes by itself",
        "The control divides this cycle into passes of its own. They are left out: the tool stays where the cycle ends. The "
        "contour that it works towards is read where the program finishes it.",
        "post the passes as single motions where they matter",
    ),
    "W380": Entry(
        "a program for turning",
        "Its path is read, checked and drawn: radius over Z, in the plane Y = 0. Turning removes no material here, so no job "
        "runs it.",
        'confirm what X words are: lathe = "diameter" under [program.control], or --control',
    ),
    "W381": Entry(
        "feed per turn without a speed",
        "G95 and taps count the feed in turns of the spindle, and no S tells how fast these are, or no pitch how far they lead. "
        "The path is right; times, chips and forces are those of a guess: 1000 rev/min, a pitch of 1 mm.",
        "give the speed by S, the pitch in the cycle",
    ),
    "W382": Entry(
        "a macro of the builder",
        "Programs O8000 to O9999 come with the machine, for tool changes, probes, breakage and pallets. This one is not here, "
        "and is taken to move nothing that cuts.",
        "put it beside the program if it cuts",
    ),
    "W383": Entry(
        "a program that is missing",
        "The call is left out and the rest is read. Where the tool is after it is taken to be where it was before; a job does "
        "not run without the program.",
        "put the program beside this one or name its folder; an empty one will do where it moves nothing",
    ),
    "W376": Entry(
        "feeds by an override of the program",
        "OVR, OVRA, FL, FA and VELOLIM change or limit the feed of the path or of single axes. The path is right, the feeds "
        "that follow are those of F, so times, chips and forces are those at 100 %.",
        "write the feed as F",
    ),
}
