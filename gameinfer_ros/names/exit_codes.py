"""Exit codes of the commands."""

#: Success; failure at run time; invalid input; interruption, as by Ctrl-C.
DONE, FAILED, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130
