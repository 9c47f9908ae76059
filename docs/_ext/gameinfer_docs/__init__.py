"""What makes the site: parts of pages that are read off the code, figures, and formulas."""
