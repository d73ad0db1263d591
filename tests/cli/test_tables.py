"""Texts that are cut."""

from __future__ import annotations

from cli.tables import MAX_QUOTED_LENGTH, cut_middle, quote


def test_a_text_is_cut_between_words() -> None:
    """A clip's name ended in its middle."""
    words = "; ".join(f"clip 'Robot_{i:02}' is not a loop" for i in range(40))
    cut = cut_middle(words)
    head, tail = cut.split("…")
    assert len(cut) <= MAX_QUOTED_LENGTH
    assert words.startswith(head)
    assert words.endswith(tail)
    assert head.endswith(" ")
    assert tail.startswith(" ")
    assert len(cut) > MAX_QUOTED_LENGTH - 80


def test_a_long_word_is_cut_itself() -> None:
    assert len(quote("a" * 1000)) == MAX_QUOTED_LENGTH
    assert cut_middle("short") == "short"
