"""The reference of the command line, in Markdown, generated from its parsers."""

from __future__ import annotations

import argparse
import importlib

from gameinfer_docs.markdown import code, table
from gameinfer_ros.commands import cli


def commands() -> str:
    """Generate an overview, and a section with all options of each subcommand."""
    overview = table(
        ("command", "does"),
        [[f"[`gameinfer {name}`](#{name})", does] for name, (_, does) in cli.COMMANDS.items()],
    )
    parts = [overview]
    for name in cli.COMMANDS:
        module = importlib.import_module(f"gameinfer_ros.commands.{name}")
        parser = argparse.ArgumentParser(description=module.__doc__)
        module.add_arguments(parser)
        parts.append(f"## {name}\n\n{_options(parser)}")
    return "\n".join(parts)


def _options(parser: argparse.ArgumentParser) -> str:
    rows = [
        [code(_invocation(action)), (action.help or "") % vars(action)]
        for action in parser._actions
        if action.help is not argparse.SUPPRESS and "--help" not in action.option_strings
    ]
    return f"{parser.description or ''}\n\n{table(('option', 'meaning'), rows)}\n"


def _invocation(action: argparse.Action) -> str:
    """Return the names of an option and its value, as in a command line."""
    names = ", ".join(action.option_strings)
    if action.nargs == 0:
        return names
    if action.choices is not None and action.metavar is None:
        value = "|".join(str(choice) for choice in action.choices)
    else:
        value = str(action.metavar or action.dest.upper())
    return f"{names} {value}".strip()
