"""How the argument parser reads the options of a command's class, and tells of them: no types, no None, no jargon."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import is_dataclass, replace
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import tyro
from tyro.constructors import (
    MISSING_NONPROP,
    ConstructorRegistry,
    PrimitiveConstructorSpec,
    PrimitiveTypeInfo,
    StructConstructorSpec,
    StructFieldSpec,
    StructTypeInfo,
    UnsupportedTypeAnnotationError,
)

from clearway.cli.known import subcommands
from clearway.cli.train import Train
from clearway.spelling import whole_number

PLACEHOLDERS = {int: "N", float: "X", str: "WORD", Path: "PATH"}  # of an option's value in help

CONFIG_HELP = "Take options from a YAML file, a name and a value a line. The command line goes before."
CONFIG_HELP_OF_TRAIN = CONFIG_HELP.replace("YAML file,", "YAML file, such as a run's run.yaml,")
GROUPS = {"parameters": "reward", "room": "live", "perturbations": ""}  # of options, in the headings of help


def reading() -> ConstructorRegistry:
    """The rules by which tyro reads our commands."""
    rules = ConstructorRegistry()
    rules.primitive_rule(_whole_number)
    rules.primitive_rule(_choice)
    busy: list[type] = []

    @rules.struct_rule
    def command(info: StructTypeInfo) -> StructConstructorSpec | None:
        """As tyro would read a dataclass, with plainer help."""
        if not is_dataclass(info.type) or info.type in busy:
            return None
        busy.append(info.type)
        try:
            found = ConstructorRegistry.get_struct_spec(info)
        finally:
            busy.remove(info.type)
        assert isinstance(found, StructConstructorSpec)
        plain = replace(found, fields=tuple(map(_told_plainly, found.fields)))
        if not hasattr(info.type, "run") or subcommands(info.type):
            return plain
        return _with_config(plain, CONFIG_HELP_OF_TRAIN if info.type is Train else CONFIG_HELP)

    return rules


def _with_config(command: StructConstructorSpec, told: str) -> StructConstructorSpec:
    """The command with the option --config, which `config.with_config` has done away with before anything is read."""
    kind = Annotated[Path | None, tyro.conf.arg(metavar=PLACEHOLDERS[Path], help_behavior_hint=_default_told)]
    option = StructFieldSpec("config", kind, None, helptext=told)  # type: ignore[arg-type]  # Annotated

    def made(**values: Any) -> Any:
        values.pop("config", None)
        return command.instantiate(**values)

    made.__doc__ = command.instantiate.__doc__  # which help begins with
    return replace(command, instantiate=made, fields=(*command.fields, option))


def _whole_number(info: PrimitiveTypeInfo) -> PrimitiveConstructorSpec | None:
    """Whole numbers as users write them, see `whole_number`."""
    if info.type is not int:
        return None
    return PrimitiveConstructorSpec(
        nargs=1,
        metavar=PLACEHOLDERS[int],
        instance_from_str=lambda words: whole_number(words[0]),
        is_instance=lambda value: isinstance(value, int) and not isinstance(value, bool),
        str_from_instance=lambda value: [str(value)],
    )


def _choice(info: PrimitiveTypeInfo) -> PrimitiveConstructorSpec | UnsupportedTypeAnnotationError | None:
    """What may be left out as what it is, without the word None; several choices as one, in the order written."""
    kind = without_none(info.type)
    if kind is info.type:
        return None
    spec = ConstructorRegistry.get_primitive_spec(PrimitiveTypeInfo.make(kind, set(info.markers)))
    if isinstance(spec, UnsupportedTypeAnnotationError):
        return spec
    return replace(
        spec,
        is_instance=lambda value: value is None or spec.is_instance(value),
        str_from_instance=lambda value: ["None"] if value is None else spec.str_from_instance(value),
    )


def without_none(kind: Any) -> Any:
    """`X` of `X | None`, and one choice of words of a union of such; any other type as it is."""
    if get_origin(kind) not in (Union, UnionType):
        return kind
    kinds = [one for one in get_args(kind) if one is not NoneType]
    if all(get_origin(one) is Literal for one in kinds):
        return Literal[tuple(word for one in kinds for word in get_args(one))]
    return kinds[0] if len(kinds) == 1 else kind


def _told_plainly(field: StructFieldSpec) -> StructFieldSpec:
    """The option with a plain placeholder, its help as one paragraph, and its default where it says something."""
    kind, *said = get_args(field.type) if get_origin(field.type) is Annotated else (field.type,)
    placeholder = _placeholder(kind)
    if placeholder is None:
        headed: Any = Annotated[(kind, tyro.conf.arg(name=GROUPS.get(field.name, field.name)), *said)]
        return replace(field, type=headed) if is_dataclass(kind) else field
    if tyro.conf.Positional in said and field.default is not MISSING_NONPROP:
        placeholder = f"[{placeholder}]"
    metavar = None if placeholder == "" else placeholder
    plain = tyro.conf.arg(metavar=metavar, help_behavior_hint=_default_told)
    told: Any = Annotated[(kind, plain, *said)]
    return replace(field, type=told, helptext=_one_paragraph(field.helptext))


def _placeholder(kind: Any) -> str | None:
    """What stands for an option's value in help; empty for a switch, None for what is no option."""
    kind = without_none(kind)
    if kind is bool:
        return ""
    if kind in PLACEHOLDERS:
        return PLACEHOLDERS[kind]
    if get_origin(kind) is Literal:
        return "{" + ",".join(map(str, get_args(kind))) + "}"
    if get_origin(kind) is tuple:
        inner = _placeholder(get_args(kind)[0])
        return f"{inner} ..." if get_args(kind)[-1] is ... else " ".join([str(inner)] * len(get_args(kind)))
    return None


def _default_told(label: str) -> str:
    """The end of an option's help; an option that changes nothing where it is left out says so in its help itself."""
    if label in ("", "''", "None", "False"):
        return ""
    return "(on by default)" if label == "True" else f"(default: {label})"


def _one_paragraph(helptext: str | Callable[[], str | None] | None) -> Callable[[], str | None]:
    """The help without the line breaks of the source."""

    def told() -> str | None:
        text = helptext() if callable(helptext) else helptext
        return None if text is None else " ".join(text.split())

    return told
