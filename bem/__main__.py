"""`python -m bem` is the `bem` command."""

from bem.cli.app import app_main

app_main()
