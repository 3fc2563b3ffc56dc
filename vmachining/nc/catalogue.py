"""Every finding by its code: what it means, why it matters, what to do.

A block with an E is skipped; W and I are executed.
"""

from __future__ import annotations

from typing import Final

from vmachining.nc.catalogue_entry import Entry
from vmachining.nc.catalogue_more import MORE

__all__ = ["CATALOGUE", "Entry", "explain"]

CATALOGUE: Final[dict[str, Entry]] = {
    # ---- E1: characters and numbers ----
    "E101": Entry(
        "illegal character",
        "A character that no word, comment or expression can hold. Square brackets belong to numbers, "
        "they are not comments.",
        "comments are written (like this) or after a semicolon",
    ),
    "E102": Entry(
        "malformed number",
        "The characters after the letter do not form one plain number: two decimal points, two signs, or "
        "a value of a thousand million or more. There is no exponent form.",
        "write one sign and one decimal point at most",
    ),
    "E110": Entry(
        "no word of this language",
        "Letters in a row without a number. A word is one letter and a number; keywords belong to other controls.",
        "remove it, or write it as a comment",
    ),
    "E103": Entry(
        "letter without number",
        "A word is a letter and a number; a comment may not stand between the two.",
        "give the letter its number or remove it",
    ),
    "E104": Entry(
        "unmatched parenthesis",
        "A comment runs from ( to ) on one line and holds no other parenthesis.",
        "close the comment on its line",
    ),
    "E105": Entry(
        "line too long",
        "Controls read a line into a buffer of 256 characters; the line is not examined further.",
        "split the block",
    ),
    "E106": Entry(
        "character outside ASCII",
        "Letters with accents, typographic dashes and the like may stand in comments only. A minus sign "
        "copied from a document often is not the ASCII minus.",
        "retype the character",
    ),
    "E107": Entry(
        "malformed expression",
        "A bracket, function, operator or parameter name is not written as the grammar has it.",
        "expressions look like [#<depth> * 2] or SQRT[2]",
    ),
    "E108": Entry(
        "expression without value",
        "The expression is well formed but has no finite value: a parameter that was never set, a "
        "division by zero, a function outside its domain, or a number that the control keeps for itself.",
        "set the parameter in an earlier line",
    ),
    # ---- E2: the block as a whole ----
    "E201": Entry(
        "bad block number",
        "N opens its block (only a block delete slash may come before it) and has one to nine digits and "
        "no sign.",
        "move N to the front, or drop it",
    ),
    "E202": Entry(
        "word given twice",
        "Apart from G and M each letter may appear once in a block; which of two values counts is "
        "anybody's guess.",
        "keep one of the words",
    ),
    "E203": Entry(
        "two G codes of one group",
        "Codes of one modal group exclude each other, so a block may name only one of them.",
        "keep one of the codes or use two blocks",
    ),
    "E204": Entry(
        "two M codes of one group",
        "Codes of one group exclude each other, so a block may name only one of them.",
        "keep one of the codes or use two blocks",
    ),
    "E206": Entry(
        "words without one owner",
        "X, Y and Z belong either to the motion code in force or to a code such as G28 or G92. Here none "
        "is in force, or two codes claim them.",
        "name a motion code (G0 to G3), or give each code its own block",
    ),
    "E207": Entry(
        "word that nothing uses",
        "No code of this block takes this letter. A control that ignored it would hide a typing error.",
        "remove the word, or add the code that it belongs to",
    ),
    "E208": Entry(
        "unknown code",
        "The code is not known, or known and not supported here. It is refused, never ignored: the rest "
        "of the block may depend on it.",
    ),
    "E209": Entry(
        "not on this machine",
        "The code or axis belongs to another type of machine: a lathe, or a machine with more than three "
        "axes.",
        "choose a machine that has it",
    ),
    "E210": Entry(
        "code of another dialect",
        "Dialects give the same number different meanings; this one has a meaning in the dialect named only.",
    ),
    "E211": Entry(
        "not a program of this dialect",
        "The text is written in the language of another control, or it is not a program at all. It was read up to the "
        "words that show it, and nothing of it is taken.",
        "give the program in one of the dialects that are read",
    ),
    # ---- E3: meaning ----
    "E301": Entry(
        "no feed",
        "A feed move needs a feed above zero: F in this block or, in G94 and G95, in an earlier one since "
        "the feed mode was chosen. In inverse time (G93) every feed move has its own F. In G95 the "
        "spindle must turn.",
        "program F",
    ),
    "E302": Entry(
        "arc without centre",
        "A circle needs R, or at least one centre word of its plane (both of them with G90.1).",
        "add R, or I J, K I, J K for G17, G18, G19",
    ),
    "E303": Entry(
        "arc with R and centre",
        "R and centre words are two ways to say the same thing.",
        "keep one of them",
    ),
    "E304": Entry(
        "centre does not fit",
        "Start and end have different distances from the centre, by more than the rounding of printed "
        "coordinates explains: over 0.028 mm (0.0028 inch) and over 0.1 % of the radius, or over a "
        "hundred times the former.",
        "check the centre words: increments from the start point unless G90.1",
    ),
    "W304": Entry(
        "centre fits badly",
        "Start and end radius differ by more than 0.01 mm but within what controls accept. The arc is "
        "executed through both programmed ends.",
        "post the program with more decimals",
    ),
    "E305": Entry(
        "radius too small",
        "No circle of this radius reaches from start to end. Up to 0.002 mm short of half the chord is "
        "taken as half the chord.",
        "enlarge R",
    ),
    "E306": Entry(
        "full circle with R",
        "Start and end are one point, so the centre could lie anywhere at distance R.",
        "use centre words",
    ),
    "E307": Entry(
        "centre word of another plane",
        "G17 takes I J, G18 K I, G19 J K.",
        "choose the plane, or the other centre word",
    ),
    "E308": Entry(
        "zero radius",
        "The centre is the start point.",
        "check the centre words",
    ),
    "E309": Entry(
        "bad number of turns",
        "P of an arc counts its turns: a whole number, one or more.",
        "remove P, or make it whole",
    ),
    "E311": Entry(
        "spindle without speed",
        "M3 and M4 need S above zero, here or earlier.",
        "program S",
    ),
    "E312": Entry(
        "negative speed",
        "S is never negative; M4 turns the other way.",
        "use M4",
    ),
    "E321": Entry(
        "tool not in the table",
        "The tool table given does not hold this number, so the length is unknown.",
        "add the tool to the table",
    ),
    "W321": Entry(
        "tool length unknown",
        "No tool table was given, so the tool length is taken as zero. The path of the tool tip does not "
        "depend on it, machine coordinates do.",
        "give a tool table",
    ),
    "E322": Entry(
        "bad tool number",
        "T and H are whole numbers from zero up.",
        "check the number",
    ),
    "E323": Entry(
        "tool change without tool",
        "M6 needs a T in its block or before it; M61 needs Q.",
        "program T",
    ),
    "E371": Entry(
        "offset without axis",
        "G92, G52 and G43.1 set the axes that they name; this block names no axis.",
        "name an axis",
    ),
    "E372": Entry(
        "G53 without a straight motion",
        "G53 makes one G0 or G1 block go to machine coordinates. It cannot stand alone, with arcs, or in "
        "G91.",
        "write G53 G0 with axis words, in G90",
    ),
    # ---- warnings about meaning ----
    "W302": Entry(
        "feed beside a change of units",
        "In a block F is read before G20 or G21, so it is in the old units. Other controls read it in the "
        "new ones.",
        "give the units their own block before F",
    ),
    "W501": Entry(
        "feed with the spindle stopped",
        "A feed move while the spindle is stopped. A tool change and M5 stop it. Reported once for each stop.",
        "M3 S...",
    ),
    # ---- the program as a whole ----
    "I213": Entry(
        "taken from the program",
        "What neither the job nor a word of the program says was concluded from the rest of the program: a unit, a "
        "coordinate system.",
        "if the control does otherwise, change the program or what the job says of it",
    ),
    "W213": Entry(
        "unit not named",
        "Neither the job nor a word of the program (G20, G21, G70, G71) says whether lengths are mm or inches.",
        'say it: units = "mm" or "inch" under [program], or --units',
    ),
    "W214": Entry(
        "lengths without a decimal point",
        "Controls of the Fanuc family can count a length without a decimal point in least increments: X10 is then "
        "0.01 mm and no 10 mm. Which of the two holds is a parameter of the control (3401 DPI); it matters most where "
        "a program has both kinds.",
        'write the points, or say it: increments = "points" or "IS-B" under [program.control], or --control',
    ),
    "I214": Entry(
        "accepted, without effect here",
        "A word of the control that changes no path (coolant, look-ahead, wear, messages), or one whose value is not "
        "known to the program. Reported once for each word.",
    ),
    "I361": Entry(
        "arc read as lines",
        "A circle about an axis other than X, Y and Z is read as short lines on it.",
    ),
    "I212": Entry(
        "dialect recognised",
        "No dialect was chosen, so the one was taken that the text looks most like.",
        'if it is another: dialect = "..." under [program], or --dialect',
    ),
    "W401": Entry(
        "no end of program",
        "The last line was reached without M2, M30 or a closing tape mark %; the file may be cut off.",
        "end the program with M30",
    ),
    "W402": Entry(
        "block number used twice",
        "Two blocks have the same N.",
        "renumber the program",
    ),
    "W403": Entry(
        "block numbers not rising",
        "N is smaller than that of an earlier block.",
        "renumber the program",
    ),
    "W404": Entry(
        "text after the end",
        "Nothing after M2, M30 or the closing % is executed.",
        "remove it",
    ),
    "I405": Entry(
        "tape mark at the end only",
        "The program has one %, after its last block. It is taken as the closing mark; read strictly it "
        "would open the tape, and everything before it would be ignored.",
        "put a % before the program too",
    ),
    "W406": Entry(
        "no motion",
        "No block of the program moves the tool.",
        "is it the right file?",
    ),
    "I407": Entry(
        "warnings not listed",
        "One warning came very often; only the first are listed.",
    ),
    "E408": Entry(
        "examination stopped",
        "So many blocks are wrong that the file is hardly a program of this dialect.",
        "check the file and the dialect",
    ),
    **MORE,
}


def explain(code: str) -> Entry:
    """The catalogue entry of a code.

    Raises KeyError: No such code.
    """
    return CATALOGUE[code]
