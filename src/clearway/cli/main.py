"""`clearway`: reads the command line and runs one command.

Exit codes: 0 success; 2 bad input, with one line that says what, where and the remedy; 130 interrupted.
"""

from __future__ import annotations

import io
import os
import select
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import tyro

from clearway.cli.config import with_config
from clearway.cli.console import showing_warnings
from clearway.cli.demo import Demo
from clearway.cli.encode import EncodeScenes
from clearway.cli.evaluate import Evaluate
from clearway.cli.examples import Examples
from clearway.cli.export import ExportAgent
from clearway.cli.generate import Generate
from clearway.cli.imports.command import ImportScenes
from clearway.cli.oracle import Oracle
from clearway.cli.parse import refusals_in_one_line
from clearway.cli.plugins import Plugins
from clearway.cli.pretrain import Pretrain
from clearway.cli.reading import reading
from clearway.cli.reproduce import Report, Reproduce
from clearway.cli.runs import Runs
from clearway.cli.scenes import Build, Export, Inspect
from clearway.cli.serve import Serve
from clearway.cli.train import Train
from clearway.cli.video import Video
from clearway.cli.view import ViewRuns, ViewScene
from clearway.cli.views import TakeViews
from clearway.errors import ArgumentError, ClearwayError, is_out_of_memory, printable, reason_of

DESCRIPTION = (
    "Train, evaluate and look at agents that walk to the place where a picture was taken, "
    "designed to anticipate collisions. Begin with: clearway view --example"
)


@dataclass(frozen=True)
class Scenes:
    """Scene files: build and generate rooms, take views of them, import others, encode, inspect, walk through, export.

    Example: clearway scenes inspect bathroom.h5
    """

    command: (
        Annotated[Build, tyro.conf.subcommand("build")]
        | Annotated[Generate, tyro.conf.subcommand("generate")]
        | Annotated[TakeViews, tyro.conf.subcommand("views")]
        | Annotated[ImportScenes, tyro.conf.subcommand("import")]
        | Annotated[EncodeScenes, tyro.conf.subcommand("encode")]
        | Annotated[Inspect, tyro.conf.subcommand("inspect")]
        | Annotated[Export, tyro.conf.subcommand("export")]
        | Annotated[ViewScene, tyro.conf.subcommand("view")]
    )

    def run(self) -> None:
        """Run the chosen command."""
        self.command.run()


Command = (
    Annotated[Demo, tyro.conf.subcommand("demo")]
    | Annotated[Examples, tyro.conf.subcommand("examples")]
    | Annotated[Scenes, tyro.conf.subcommand("scenes")]
    | Annotated[Pretrain, tyro.conf.subcommand("pretrain")]
    | Annotated[Train, tyro.conf.subcommand("train")]
    | Annotated[Evaluate, tyro.conf.subcommand("evaluate")]
    | Annotated[Runs, tyro.conf.subcommand("runs")]
    | Annotated[Oracle, tyro.conf.subcommand("oracle")]
    | Annotated[Reproduce, tyro.conf.subcommand("reproduce")]
    | Annotated[Report, tyro.conf.subcommand("report")]
    | Annotated[Video, tyro.conf.subcommand("video")]
    | Annotated[ViewRuns, tyro.conf.subcommand("view")]
    | Annotated[ExportAgent, tyro.conf.subcommand("export")]
    | Annotated[Serve, tyro.conf.subcommand("serve")]
    | Annotated[Plugins, tyro.conf.subcommand("plugins")]
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command that the arguments (by default the process's own) ask for, then exit."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # what a terminal has no letters for is no reason to end
    sys.exit(_exit_code(words))


def _exit_code(words: Sequence[str]) -> int:
    try:
        if words == ["--version"]:
            from clearway.version import __version__

            print(f"clearway {__version__}")
        else:
            _run(words)
        sys.stdout.flush()  # here, where it can still be told that nothing could be written
    except ArgumentError as error:
        return _refused(_as_option(str(error)))
    except ClearwayError as error:
        return _refused(str(error))
    except OSError as error:
        left = isinstance(error, BrokenPipeError) and _reader_has_left()
        _drop_unprinted()
        if left:
            return 0
        where = f"{error.filename}: " if error.filename else ""
        return _refused(f"{where}{error.strerror or error}. Check the path, its permissions and the space left")
    except (MemoryError, RuntimeError) as error:
        if not is_out_of_memory(error):
            raise
        told = f"not enough memory ({reason_of(error)})"
        return _refused(f"{told}. Free some, or ask for less at once; a training goes on with --resume")
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return 130
    return 0


def _run(words: Sequence[str]) -> None:
    """Run the command that the words ask for."""
    words = with_config(words, Command)
    with refusals_in_one_line(words, Command):
        command = tyro.cli(
            Annotated[Command, tyro.conf.arg(help="what to do")],  # or tyro reads all of typing for one
            args=words,
            prog="clearway",
            description=DESCRIPTION,
            config=(tyro.conf.OmitArgPrefixes, tyro.conf.OmitSubcommandPrefixes, tyro.conf.DisallowNone),
            registry=reading(),
        )
    with showing_warnings():
        command.run()


def _as_option(told: str) -> str:
    """What a function says of an argument, "step_limit=0: too low", as of an option: "--step-limit 0: too low"."""
    name, equals, rest = told.partition("=")
    return f"--{name.replace('_', '-')} {rest}" if equals and name.isidentifier() else told


def _reader_has_left() -> bool:
    """Standard output is a pipe that nobody reads any more."""
    try:
        watched = select.poll()
        watched.register(sys.stdout.fileno(), 0)
        return any(event & select.POLLERR for _, event in watched.poll(0))
    except (AttributeError, OSError):  # no such call, or no file behind it
        return False


def _drop_unprinted() -> None:
    """Drop what standard output holds and cannot be written."""
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _refused(message: str) -> int:
    """Say what was wrong in one line; returns the exit code."""
    if "/remote/" in message:  # perhaps a file of the cache, whose place there tells the user nothing
        from clearway.remote.records import with_origins

        message = with_origins(message)
    print("error:", printable(" ".join(message.split())), file=sys.stderr)
    return 2
