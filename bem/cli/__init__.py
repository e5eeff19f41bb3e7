"""The command `bem`."""


def app_main() -> None:
    """Run the command; its modules load with the first call, so that importing a part of the folder loads no other."""
    from bem.cli.app import app_main

    app_main()
