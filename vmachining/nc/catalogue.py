"""Every finding by its code: what it means, why it matters, what to do.

A block with an E is skipped; W and I are executed.
"""

from __future__ import annotations

from typing import Final

from vmachining.nc.catalogue_entry import Entry
from vmachining.nc.catalogue_more import MORE

CATALOGUE: Final[dict[str, Entry]] = {
    # ---- E1: characters and numbers ----
    "E101": Entry(
        "illegal character",
        "No word, comment or expression can contain this character. Square brackets enclose expressions, "
        "not comments.",
        "write comments (like this) or after a semicolon",
    ),
    "E102": Entry(
        "malformed number",
        "The characters after the letter do not form one plain number: two decimal points, two signs, or "
        "a value of a thousand million or more. There is no exponent form.",
        "write one sign and one decimal point at most",
    ),
    "E110": Entry(
        "not a word of this language",
        "Several letters without a number. A word is one letter and a number; keywords belong to other controls.",
        "remove it, or write it as a comment",
    ),
    "E103": Entry(
        "letter without number",
        "A word is a letter and a number, with no comment between the two.",
        "give the letter its number or remove it",
    ),
    "E104": Entry(
        "unmatched parenthesis",
        "A comment runs from ( to ) on one line and contains no other parenthesis.",
        "close the comment on its line",
    ),
    "E105": Entry(
        "line too long",
        "Controls read a line into a buffer of 256 characters. The rest of this line is not examined.",
        "split the block",
    ),
    "E106": Entry(
        "character outside ASCII",
        "Accented letters, typographic dashes and the like are allowed in comments only. A minus sign "
        "copied from a document is often not the ASCII minus.",
        "retype the character",
    ),
    "E107": Entry(
        "malformed expression",
        "A bracket, function, operator or parameter name does not follow the grammar.",
        "expressions look like [#<depth> * 2] or SQRT[2]",
    ),
    "E108": Entry(
        "expression without value",
        "The expression is well formed but has no finite value: a parameter that was never set, a "
        "division by zero, a function outside its domain, or a number known only to the control.",
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
        "Apart from G and M, each letter may appear once in a block; controls differ in which of two values "
        "they use.",
        "keep one of the words",
    ),
    "E203": Entry(
        "two G codes of one group",
        "Codes of one modal group exclude each other, so a block may contain only one of them.",
        "keep one of the codes or use two blocks",
    ),
    "E204": Entry(
        "two M codes of one group",
        "Codes of one group exclude each other, so a block may contain only one of them.",
        "keep one of the codes or use two blocks",
    ),
    "E206": Entry(
        "words without a code",
        "X, Y and Z belong either to the active motion code or to a code such as G28 or G92. Here no motion "
        "code is active, or two codes use them.",
        "program a motion code (G0 to G3), or put each code into a separate block",
    ),
    "E207": Entry(
        "word that nothing uses",
        "No code of this block uses this letter. Ignoring it could hide a typing error.",
        "remove the word, or add the code that it belongs to",
    ),
    "E208": Entry(
        "unknown code",
        "The code is unknown or not supported here. It is refused, never ignored: the rest "
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
        "The same code has different meanings in different dialects; this one exists only in the named dialect.",
    ),
    "E211": Entry(
        "not a program of this dialect",
        "The text is in the language of another control, or it is not a program at all. Reading stopped at the "
        "words that show it, and nothing was used.",
        "supply the program in one of the supported dialects",
    ),
    # ---- E3: meaning ----
    "E301": Entry(
        "no feed",
        "A feed move needs a feed above zero: F in this block or, in G94 and G95, in an earlier block after "
        "the feed mode was set. In inverse time (G93) every feed move needs its own F. In G95 the "
        "spindle must turn.",
        "program F",
    ),
    "E302": Entry(
        "arc without centre",
        "An arc needs R, or at least one centre word of its plane (both with G90.1).",
        "add R, or I J, K I, J K for G17, G18, G19",
    ),
    "E303": Entry(
        "arc with R and centre",
        "R and centre words are two ways to define the same arc.",
        "keep one of the two",
    ),
    "E304": Entry(
        "centre does not fit",
        "The distances of start and end from the centre differ by more than rounded "
        "coordinates explain: by over 0.028 mm (0.0028 inch) and 0.1 % of the radius, or by over a "
        "hundred times that length.",
        "check the centre words: they are increments from the start point unless G90.1 is active",
    ),
    "W304": Entry(
        "centre fits badly",
        "Start and end radius differ by more than 0.01 mm, but controls accept it. The arc is "
        "executed through both programmed end points.",
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
        "Start and end coincide, so the centre could lie in any direction at distance R.",
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
        "P (TURN in Sinumerik) counts the turns of an arc: a whole number.",
        "make the number whole, or remove it",
    ),
    "E311": Entry(
        "spindle without speed",
        "M3 and M4 need S above zero, in this block or earlier.",
        "program S",
    ),
    "E312": Entry(
        "negative speed",
        "S is never negative; M4 reverses the spindle.",
        "use M4",
    ),
    "E321": Entry(
        "tool not in the table",
        "The tool table does not contain this number, so the tool length is unknown.",
        "add the tool to the table",
    ),
    "W321": Entry(
        "tool length unknown",
        "There is no tool table, so the tool length is taken as zero. The path of the tool tip does not "
        "depend on it, but machine coordinates do.",
        "give a tool table",
    ),
    "E322": Entry(
        "bad tool number",
        "T and H must be whole numbers, zero or larger.",
        "check the number",
    ),
    "E323": Entry(
        "tool change without tool",
        "M6 needs a T in its block or before it; M61 needs Q.",
        "program T",
    ),
    "E371": Entry(
        "offset without axis",
        "G92, G52 and G43.1 set the axes in their block; this block has no axis word.",
        "name an axis",
    ),
    "E372": Entry(
        "G53 without a straight motion",
        "G53 sends one G0 or G1 block to machine coordinates. It does not work alone, with arcs, or in G91.",
        "write G53 G0 with axis words, in G90",
    ),
    # ---- warnings about meaning ----
    "W302": Entry(
        "feed in the block that changes units",
        "F is read before G20 or G21 of the same block, so it is in the old units. Other controls use the "
        "new ones.",
        "put the change of units into a separate block before F",
    ),
    "W501": Entry(
        "feed with the spindle stopped",
        "A feed move while the spindle is stopped. M5 and a tool change stop it. Reported once for each stop.",
        "program M3 S... before the feed move",
    ),
    # ---- the program as a whole ----
    "I213": Entry(
        "taken from the program",
        "Neither the job nor a word of the program defines this (a unit, a coordinate system, ...), so it was concluded "
        "from the rest of the program.",
        "if your control does it differently, change the program or the job",
    ),
    "W213": Entry(
        "unknown unit",
        "Neither the job nor a word of the program (G20, G21, G70, G71) tells whether lengths are mm or inches.",
        'set units = "mm" or "inch" under [program], or --units',
    ),
    "W214": Entry(
        "lengths without a decimal point",
        "Controls of the Fanuc family can count a length without a decimal point in least increments: X10 is then "
        "0.01 mm, not 10 mm. A parameter of the control decides (3401 DPI); it matters most if "
        "a program has both kinds.",
        'write the decimal points, or set increments = "points" or "IS-B" under [program.control], or --control',
    ),
    "I214": Entry(
        "accepted, without effect here",
        "A word that does not change the path (coolant, look-ahead, wear, messages), or one whose value the program does "
        "not contain. Reported once for each word.",
    ),
    "I361": Entry(
        "arc read as lines",
        "A circle about an axis other than X, Y and Z is replaced by short lines.",
    ),
    "I212": Entry(
        "dialect detected",
        "No dialect was chosen, so the most similar one is used.",
        'to choose another, set dialect = "..." under [program], or --dialect',
    ),
    "W401": Entry(
        "no end of program",
        "The file ends without M2, M30 or a closing tape mark %; it may be truncated.",
        "end the program with M30",
    ),
    "W402": Entry(
        "block number used twice",
        "Two blocks have the same N.",
        "renumber the program",
    ),
    "W403": Entry(
        "block numbers not ascending",
        "N is smaller than in an earlier block.",
        "renumber the program",
    ),
    "W404": Entry(
        "text after the end",
        "Nothing after M2, M30 or the closing % is executed.",
        "remove it",
    ),
    "I405": Entry(
        "tape mark at the end only",
        "The program has a single %, after its last block. It is taken as the closing mark; read strictly, it "
        "would open the tape, and everything before it would be ignored.",
        "add a % before the program",
    ),
    "W406": Entry(
        "no motion",
        "No block of the program moves the tool.",
        "check that this is the right file",
    ),
    "I407": Entry(
        "warnings not listed",
        "One warning occurred very often; only the first ones are listed.",
    ),
    "E408": Entry(
        "reading stopped",
        "So many blocks are wrong that the file is probably not a program of this dialect.",
        "check the file and the dialect",
    ),
    **MORE,
}


def explain(code: str) -> Entry:
    """The catalogue entry of a code.

    Raises KeyError: No such code.
    """
    return CATALOGUE[code]
