"""Words of Sinumerik programs: what is known, accepted with a note, and refused by name."""

from __future__ import annotations

from typing import Final

from vmachining.nc.placing import EdgeFeed

AXES: Final = {"X": 0, "Y": 1, "Z": 2}
ROTARY: Final = "ABC"
_NOTED = """
    SOFT BRISK DRIVE FFWON FFWOF COMPCAD COMPON COMPCURV COMPSURF COMPOF KONT KONTC KONTT NORM
    STOPRE FNORM FLIN DIAMOF CUT2D CUT2DF CUT3DC FIFOCTRL STARTFIFO STOPFIFO PREPRO BLSYNC DYNNORM DYNPOS
    DYNROUGH DYNSEMIFIN DYNFINISH SUPD SBLOF SBLON ASPLINEOF DISPLOF DISPLON ADISPOSA CPRECON CPRECOF PTP CP UPATH
    SPATH WALIMON WALIMOF BRISKA SOFTA SAVE ACTBLOCNO DELAYFSTON DELAYFSTOF ORISON ORISOF ORICONTO PAROTOF TOROTOF
    TOFRAMEOF PRECON LEADOF RTLION RTLIOF EXTERNAL
"""
NOTED: Final = frozenset(_NOTED.split())
_NOTED_CALLS = """
    MSG WORKPIECE CYCLE832 SETMS SETAL GROUP_BEGIN GROUP_END GROUP_ADDEND TRAORI TRAFOOF CLEARM WAITM INIT START
    DELT CYCLE_HSC STOPRE GETT SPOS FXS CTRANS PRIO WAITP M SETM WAITMC WAITE WAITS RELEASE GET GETD CHANDATA
"""
NOTED_CALLS: Final = frozenset(_NOTED_CALLS.split())
NOTED_SET: Final = frozenset({"SPOS", "SPOSA", "ACC", "ADIS", "ADISPOS",
                              "FGREF", "DISC", "SF", "OTOL", "CTOL", "ORISON", "STOLF", "ATOL",
                              "SCC", "G", "H"})  # fmt: skip
EDGE_FEEDS: Final[dict[str, EdgeFeed]] = {"CFC": "all", "CFIN": "inner", "CFTCP": ""}
"""Feed on arcs under compensation: of the contour (as the control starts), of inner arcs only, of the tool centre."""
ORIENTED: Final = frozenset("ORIWKS ORIAXES ORIVECT ORIROTA ORIEULER ORIRPY ORIRPY2 ORIVIRT1 ORIMKS".split())  # noqa: SIM905
FEED_SET: Final = frozenset({"FL", "FA", "OVR", "OVRA", "VELOLIM"})
_KINDS: Final = {
    "splines": "ASPLINE BSPLINE CSPLINE SPLINEPATH",
    "polynomials": "POLY POLYPATH",
    "involutes": "INVCW INVCCW",
    "PAROT": "PAROTS",
    "compensation in space": "CUT3DF CUT3DFS CUT3DFF CUT3DCC CUT3DCCD",
    "probing": "MEAS MEAW MEAC MEAWA MEASA",
    "OEM interpolation": "OEMIPO1",
    "files": "WRITE",
    "contour tables": "CONTPRON",
    "diameters (a lathe)": "DIAMON DIAM90",
    "TANG": "TANGON",
    "coupled axes": "COUPON TRAILON LEADON",
    "curve tables": "CTABDEF",
    "REPOS": "REPOSL REPOSA",
    "PRESETON": "PRESETONS",
    "synchronized actions": "WHEN WHENEVER EVERY",
}
_ALONE = """
    TRANSMIT TRACYL ROTS AROTS CRPL TOFRAME TOROT TOROTX TOROTY PAROT TRAANG GEOAX TANG OFFN TRACON PRESETON
    TCARR TCOABS TCOFR ORICURVE ORIPLANE
"""
REFUSED: Final = {word: kind for kind, words in _KINDS.items() for word in words.split()} | {
    word: word for word in _ALONE.split()
}
"""What is refused by name, and what it is."""
GNOTED: Final = frozenset({9.0, 25.0, 26.0, 60.0, 62.0, 64.0, 290.0, 450.0, 460.0, 461.0, 462.0, 601.0, 602.0, 603.0,
                           621.0, 641.0, 642.0, 643.0, 644.0, 645.0, 810.0,})  # fmt: skip
KNOWN: Final = frozenset(map(float, (
    *range(5), 17, 18, 19, 33, 40, 41, 42, 53, 54, 55, 56, 57, 70, 71, 74, 75, 90, 91, 93, 94, 95, 96, 97, 110, 111, 112, 153,
    331, 332, 451, 700, 710, 961, 962, 971, 973,
)))  # fmt: skip
USED: Final = frozenset({
    *AXES, *ROTARY, "I", "J", "K", "I1", "J1", "K1", "X1", "Y1", "Z1", "CR", "AR", "TURN", "CHF", "CHR", "RND", "RNDM", "FP",
    "FB", "FRC", "FRCM", "A3", "B3", "C3", "AP", "RP", "ANG", "F", "S", "T", "D",
})  # fmt: skip
NOT_A_VARIABLE: Final = frozenset({
    "OFFN", "POS", "POSA", "POSP", "THETA", "PHI", "PSI", "NUT", "LEAD", "TILT", "ISD", "DILF", "POLF", "ANG1", "ANG2", "DISR",
    "DISCL", "DISRP", "FAD", "FPR", "FPRAON", "CRPL", "RPL", "OSCILL", "OSP1", "OSP2", "OSCTRL", "TCARR", "TOFFL", "TOFFR",
    "TOFF", "MEAS", "MEAW", "MEASA", "FENDNORM", "GEOAX", "PUTFTOC", "TANG", "CUTMOD", "CUTMODK", "OFFNX", "SPOS", "ROTS",
    "AROTS", "DITS", "DITE", "OVRRAP", "VELOLIMA", "ACCLIMA", "JERKLIMA", "MOV", "SPATH", "UPATH", "XE", "ZE",
})  # fmt: skip
"""Addresses that act on the path and are not supported: no variables of the machine."""
