"""The Sphinx extensions of the site: generated references, figures and formulas."""
