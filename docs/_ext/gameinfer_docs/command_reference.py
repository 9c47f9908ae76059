"""The reference of the command line, in Markdown, generated from its parsers."""

from __future__ import annotations

import argparse
import importlib
import re
from collections.abc import Iterator

from gameinfer_docs.markdown import code, table
from gameinfer_ros.commands import cli


def parsers() -> Iterator[tuple[str, argparse.ArgumentParser]]:
    """Yield the name and the parser of each subcommand of `gameinfer`."""
    for name in cli.COMMANDS:
        module = importlib.import_module(f"gameinfer_ros.commands.{name}")
        parser = argparse.ArgumentParser(prog=f"gameinfer {name}", description=module.__doc__)
        module.add_arguments(parser)
        yield name, parser


def commands() -> str:
    """Generate an overview, and a section with all options of each subcommand."""
    overview = table(
        ("command", "does"),
        [
            [f"[`gameinfer {name}`](#{name})", purpose]
            for name, (_, purpose) in cli.COMMANDS.items()
        ],
    )
    sections = [f"## {name}\n\n{_options(parser)}" for name, parser in parsers()]
    return "\n".join([overview, *sections])


def _options(parser: argparse.ArgumentParser) -> str:
    rows = [
        [code(_invocation(action)), _sentence(action)]
        for action in parser._actions
        if action.help is not argparse.SUPPRESS and "--help" not in action.option_strings
    ]
    parts = [parser.description or "", table(("option", "meaning"), rows)]
    if parser.epilog:
        parts.append(re.sub(r"(--ros-args -.*)$", r"`\1`", parser.epilog))
    return "\n\n".join(parts) + "\n"


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


def _sentence(action: argparse.Action) -> str:
    return (action.help or "") % vars(action)
