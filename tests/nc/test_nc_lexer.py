"""Words and their places."""

from __future__ import annotations

import pytest

from vmachining.nc import lex_line, split_lines


def test_places_of_words_and_comments():
    line = lex_line("/N10 g 0 1 x 2 . 5 (hi) y-[#<a b> + 2] z#5 ;c(")
    assert line.block_delete and not line.errors
    assert [(w.letter, w.value, w.col, w.text) for w in line.words] == [
        ("N", 10, 2, "N10"),
        ("G", 1, 6, "g 0 1"),
        ("X", 2.5, 12, "x 2 . 5"),
        ("Y", None, 25, "y-[#<a b> + 2]"),
        ("Z", None, 40, "z#5"),
    ]
    assert [line.text[c - 1 : c - 1 + n] for c, n in line.comments] == ["(hi)", ";c("]
    assert all(line.text[w.col - 1 : w.col - 1 + w.length] == w.text for w in line.words)


@pytest.mark.parametrize("text", ["X1", "x1.", "X+1.0", "X 1", "X01", "X\t1 ", "X+ 1 . 0 0", "x[1]"])
def test_spellings_of_a_number(text):
    (word,) = lex_line(text).words
    assert word.letter == "X" and word.value in (1.0, None) and word.text == text.strip()


def test_program_numbers_and_control_flow():
    assert lex_line("O2000 (part)").label.value == 2000
    assert lex_line(":55").label.value == 55
    assert lex_line("N5 o<drill> SUB").flow == "sub"
    assert lex_line("  %\t").percent


def test_assignments():
    (item,) = lex_line("#<a> = [1 + 2] (c)").assignments
    assert (item.target.name, item.col, item.text) == ("a", 1, "#<a> = [1 + 2]")


def test_line_ends():
    assert split_lines("a\nb\r\nc\rd") == ["a", "b", "c", "d"]
    assert split_lines("a\n\n") == ["a", ""]
    assert split_lines("") == []
