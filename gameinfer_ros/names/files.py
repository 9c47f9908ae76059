"""Names of files."""

#: File name extensions of animations.
GIF, MP4 = ".gif", ".mp4"
