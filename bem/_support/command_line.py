"""Shared by all command lines: the option `--version`, error messages, exit status and a progress bar.

A user's mistake becomes one sentence on standard error and exit status 2.
"""

import re
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from bem._support.interruption import INTERRUPTED, end
from bem._support.wording import shortened

FAILURES = ("RuntimeError", "CampaignError", "FitError")
"""Errors by which a study, a campaign or a fit says that it did not complete; by name, since they load libraries."""
FIRST_TABOR = 1.0
FIRST_PROTOCOL = {"peak_indentation": 5.0, "loading_rate": 10.0, "dwell_time": 1.0, "unloading_rate": 200.0}
"""A contact to begin with, where the user describes none: the paper's sample protocol (1)."""
HELP_NAMES = {"help_option_names": ["-h", "--help"]}
LONGEST = 2000
"""Characters of a sentence at most, whatever a user's file or option holds; paths fit whole."""


_USAGE = {
    r"Invalid value for '(.+?)'.*?: (.+) is not a valid float\.": "{0} must be a number; received {1}",
    r"Invalid value for '(.+?)'.*?: (.+) is not a valid int(?:eger)?\.": "{0} must be an integer; received {1}",
    r"Invalid value for '(.+?)'.*?: (.+) is not one of (.+)\.": "{0} must be one of {2}; received {1}",
    r"Missing (?:option|argument) '(.+?)'.*": "{0} must be given; received none",
    r"Option '(.+?)' requires an argument\.": "{0} must have a value; received none",
    r"No such option: (\S+)(.*)": "options must be those that --help lists; received {0}{1}",
    r"Got unexpected extra argument\S* \((.+)\)": "options must have names, as --help lists them; received {0}",
    r"No such command (.+)\.": "the command must be one of {commands}; received {0}",
}
"""Sentences of Typer about the command line, and ours."""
_option_of: dict[str, str] = {}  # of the command that runs, by the name of its parameter


class Commands(TyperGroup):
    """Commands whose sentences name an option as it is typed."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Choose the command by its name, and remember its options."""
        name, command, rest = super().resolve_command(ctx, args)
        options = {parameter.name: parameter.opts[0] for parameter in command.params}
        _option_of.clear()
        _option_of.update({name: typed for name, typed in options.items() if typed == f"--{name.replace('_', '-')}"})
        return name, command, rest


def add_version(app: Any, name: str, number: str) -> None:
    """Give a Typer application of several commands the option `--version`.

    Args:
        app: The application.
        name: The command's name, which stands before the version.
        number: Its version.
    """

    def show(requested: bool) -> None:
        if requested:
            typer.echo(f"{name} {number}")
            raise typer.Exit

    @app.callback()
    def options(
        version: Annotated[
            bool, typer.Option("--version", callback=show, is_eager=True, help="Show the version.")
        ] = False,
    ) -> None:
        pass


@contextmanager
def one_sentence(name: str, *, failures: bool = True) -> Iterator[None]:
    """Leave the process with one sentence instead of a traceback: status 2 for a mistake, 1 for a failure.

    A mistake of the user is a `ValueError` or an error of the operating system, a failure one of `FAILURES`. It serves
    as a decorator of a command too.

    Args:
        name: The command's name, which begins the sentence.
        failures: Whether failures end so too.
    """
    try:
        yield
    except (ValueError, OSError, RuntimeError) as error:
        mistake = isinstance(error, ValueError | OSError)
        # Other kinds, such as endless recursion, are mistakes of the program: they keep their traceback.
        if not mistake and not (failures and type(error).__name__ in FAILURES):
            raise
        typer.echo(f"{name}: {sentence(error)}", err=True)
        sys.exit(2 if mistake else 1)


def run_command(app: Any, name: str, program: str | None = None, *, failures: bool = False) -> None:
    """Run a Typer application and leave the process with its status.

    Args:
        app: The application.
        name: The command's name, which begins the sentence.
        program: How the command is called, for its help; found out by default.
        failures: Whether failures end in one sentence too, as `one_sentence` says.
    """
    _option_of.clear()
    try:
        with one_sentence(name, failures=failures):
            status = app(standalone_mode=False, prog_name=program)
    except typer.Abort as abort:  # what Typer makes of `EOFError` too
        if not isinstance(abort.__cause__, KeyboardInterrupt):
            raise abort.__cause__ or abort from None
        status = INTERRUPTED
    except Exception as error:
        # Typer brings its own copy of click's exceptions or takes click's, depending on its version.
        if not hasattr(error, "format_message"):
            raise
        if type(error).__name__ == "NoArgsIsHelpError":
            error.show()
        else:
            typer.echo(f"{name}: {shortened(usage_sentence(error), LONGEST)}", err=True)
        sys.exit(error.exit_code)
    if status == INTERRUPTED:  # what Typer makes of `KeyboardInterrupt`, in some versions by `Abort`
        end(name)
    sys.exit(status if isinstance(status, int) else 0)


def run_main(main: Callable[..., Any], name: str | None = None, *, program: str | None = None, **settings: Any) -> None:
    """Run a module's function as a command of its own, and leave the process with its status.

    A `RuntimeError`, by which a study reports that a step failed, ends it with one sentence and status 1.

    Args:
        main: The function; its parameters are the command's.
        name: What begins the sentence; the module's name by default.
        program: How the command is called, for its help; found out by default.
        settings: Keywords of `Typer.command`.
    """
    app = typer.Typer(add_completion=False)
    app.command(**settings)(main)
    spec = main.__globals__.get("__spec__")
    name = name or (spec.name if spec else Path(sys.argv[0]).name)
    run_command(app, name, program, failures=True)


def sentence(error: Exception) -> str:
    """An error in words, on one line of bounded length; an error of the operating system with the file concerned."""
    if isinstance(error, OSError) and error.strerror:
        named = f"the file must be accessible; received {error.filename} ({error.strerror})"
        return shortened(named if error.filename else error.strerror, LONGEST)
    text = str(error)
    if " in row " not in text:  # a row of a table has columns, not options
        text = re.sub(r"(?:^|(?<=; ))\w+((, | and )\w+)*(?= must )", _options_for, text)
    return shortened(text, LONGEST)


def _options_for(quantities: re.Match[str]) -> str:
    """The options of quantities that a message names."""
    return re.sub(r"\w+", lambda name: _option_of.get(name[0], name[0]), quantities[0])


def usage_sentence(error: Any) -> str:
    """A mistake that Typer itself finds, in the grammar of the others: what, what it must be, what was received."""
    text = error.format_message()
    for pattern, words in _USAGE.items():
        if match := re.fullmatch(pattern, text):
            commands = getattr(getattr(error.ctx, "command", None), "commands", {})
            return words.format(*match.groups(), commands=", ".join(commands))
    return text


def first_default(name: str) -> str:
    """What the help of an option says of its value in the first protocol."""
    return f"{FIRST_PROTOCOL[name]:g} where no protocol is given"


def parse_accuracy(text: str) -> str | float:
    """A name or a number, as `bem.problem.accuracy` understands it."""
    try:
        return float(text)
    except ValueError:
        return text


@contextmanager
def progress_bar(total: int, counted: str = "failed") -> Iterator[Callable[..., None]]:
    """Give a function of the number of trajectories done and of those `counted`, such as failed; it shows both.

    Its third argument is another total, where that was not known before.
    """
    if not sys.stderr.isatty():
        yield lambda *_: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[line]}"), TimeRemainingColumn()
    with Progress(*columns, console=Console(stderr=True)) as bar:
        task = bar.add_task("", total=total, line="starting workers")
        change: Callable[..., None] = bar.reset  # what an earlier call did says nothing about the rate of this one

        def show(done: int, bad: int, of: int = total) -> None:
            nonlocal change
            change(task, completed=done, total=of, line=f"{bad or 'none'} {counted}, left:")
            change = bar.update

        yield show
