"""The options of each subcommand: light modules, which import nothing of what does the work.

So help, completion and complaints are there at once. A module has what `Command` says, and a line
in `gameinfer_ros.commands.cli.COMMANDS` that names the module with the work.
"""
