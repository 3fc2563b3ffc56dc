"""Programs that the sources print."""

TESTER = """\
%
O2000
N00 G20 G91
N10 M06 T03
N20 S1500 M03
N30 G92 X-1 Y+1 Z+1
N40 G00 X2.75 {n40}
N50 G01 Z-0.5 F5
N60 Y-1.25 F10
N70 X-1.5
N80 G03 X-0.5 Y-0.5 R0.5
N90 G01 Y-0.75
N100 G00 Z0.5
N110 G28
N120 M05
N139 M30
"""
"""Example 4.1 of the NC tester. n40: where block N40 goes, printed as "Y0.25 Z0.1"."""
