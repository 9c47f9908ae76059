"""The command line: one light module per subcommand, with its options.

A module imports nothing that does the work, so that help, completion and error messages are fast.
`gameinfer_ros.commands.cli.COMMANDS` names the module that does the work.
"""
