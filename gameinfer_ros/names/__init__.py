"""Constants and words that all rooms share; these modules import nothing else of the package."""
