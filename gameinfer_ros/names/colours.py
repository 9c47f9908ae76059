"""Colours of players, in pictures and for viewers."""

from __future__ import annotations

#: Colours that remain apart for colour-blind readers (Okabe and Ito).
COLOURS = ("#d55e00", "#0072b2", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")


def of_player(i: int) -> str:
    """Colour of player i as #rrggbb; those of many players begin anew."""
    return COLOURS[i % len(COLOURS)]


def rgb(colour: str) -> tuple[float, float, float]:
    """Red, green and blue, from 0 to 1, of a colour #rrggbb."""
    red, green, blue = bytes.fromhex(colour[1:])
    return red / 255, green / 255, blue / 255
