"""Arguments that several commands share: options, their types and completions, and the parser."""
