# The cells of a block with the widest bracket first: a heap of row numbers.
#
# Legend: cell (k, .) rows; their lower end stands in column `lo`, the upper one beside it. heap (k,) of n numbers.

from vmachining.jit import leaf


@leaf
def width(cell, c, lo):
    return cell[c, lo + 1] - cell[c, lo]


@leaf
def sift_up(heap, cell, i, lo) -> None:
    while i > 0:
        j = (i - 1) // 2
        if width(cell, heap[j], lo) >= width(cell, heap[i], lo):
            return
        heap[i], heap[j] = heap[j], heap[i]
        i = j


@leaf
def sift_down(heap, cell, n, lo) -> None:
    i = 0
    while 2 * i + 1 < n:
        j = 2 * i + 1
        if j + 1 < n and width(cell, heap[j + 1], lo) > width(cell, heap[j], lo):
            j += 1
        if width(cell, heap[i], lo) >= width(cell, heap[j], lo):
            return
        heap[i], heap[j] = heap[j], heap[i]
        i = j
