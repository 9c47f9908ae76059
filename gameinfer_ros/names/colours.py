"""Colours of players in figures and viewers."""

#: A palette that colour-blind readers can distinguish (Okabe and Ito).
COLOURS = ("#d55e00", "#0072b2", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")


def of_player(i: int) -> str:
    """Return the colour of player i as `#rrggbb`. Colours repeat after seven players."""
    return COLOURS[i % len(COLOURS)]


def rgb(colour: str) -> tuple[float, float, float]:
    """Return red, green and blue, each from 0 to 1, of a colour `#rrggbb`."""
    red, green, blue = bytes.fromhex(colour[1:])
    return red / 255, green / 255, blue / 255
