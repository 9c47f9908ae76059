"""The report: the results of all studies on one page, next to the published ones."""
