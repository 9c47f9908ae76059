"""What the commands exit with."""

#: All went well; something that was begun failed; what was asked for cannot be done; Ctrl-C.
DONE, FAILED, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130
