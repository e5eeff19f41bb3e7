"""`python -m bem` is the `bem` command."""

from bem.cli import app_main

app_main()
