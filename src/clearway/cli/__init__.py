"""The command line: one module a command, settings as dataclasses, everything heavy imported when a command runs."""
