"""`python -m vmachining`."""

from vmachining.cli import main

main()
