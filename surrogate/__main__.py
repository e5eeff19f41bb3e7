"""Run the command line as `python -m surrogate`."""

from surrogate.cli.app import app_main

if __name__ == "__main__":
    app_main()
