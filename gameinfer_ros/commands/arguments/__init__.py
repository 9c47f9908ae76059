"""What several commands share: options, types of arguments, completion, and the parser."""
