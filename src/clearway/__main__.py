"""`python -m clearway` is the command `clearway`."""

from clearway.cli.main import main

main()
