"""Removed volume of a block by booleans of solids, called agreed only where everybody else allows it.

1. Judges of other kinds (a proven bracket of meshes, exact rays) give intervals for one number; T is their intersection.
   Where it is empty the block is disputed: one of them is wrong.
2. ((S_0 and W_k) minus W_j) minus ... with only those earlier sweeps that reach it: no damaged stock is inherited, blocks can be
   done in any order and in parallel.
3. A boolean of tangent solids may return anything, valid or not. So there are several ways of asking for the same volume
   (`attempts.py`), made one after the other until the value of one lies in T.
4. A value in T is as good as T is narrow: its error stands next to it, and where that is not below the value itself it does
   not stand.
5. None in T: refused, with what every attempt said. T stands, and no other block is affected.

Known limits: blocks whose solids, or those of a neighbour, cannot be built are refused; so are many whose sweeps are unions
of dozens of solids (sharp turns of five axes, helices in each other), because one boolean after the other takes longer than
the limit or loses a part.
"""
