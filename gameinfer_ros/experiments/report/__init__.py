"""The report: all studies on one page, next to what was published."""
