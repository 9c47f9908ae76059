"""Names of files."""

#: Endings of animations.
GIF, MP4 = ".gif", ".mp4"
