"""The `bem` command, also `python -m bem`."""

from bem._support.interruption import end_on_interrupt


def main() -> None:
    """Run the command; what takes long to import comes after the handler of Ctrl-C."""
    end_on_interrupt("bem")
    from bem.cli.app import app_main

    app_main()


if __name__ == "__main__":
    main()
