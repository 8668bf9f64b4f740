"""Settings from a TOML file; what cannot be used is one line that names the key and the file."""

import difflib
import tomllib
import types
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError

from ses_core.errors import SettingsError
from ses_core.settings import Settings

_UNKNOWN = "extra_forbidden"


def read_settings(path: Path) -> Settings:
    """Read a settings file; what it leaves out has its default.

    Raises:
        SettingsError: The file is missing, is no TOML, or holds an unknown key or a bad value.
    """
    return parse_settings(read_settings_values(path), source=str(path))


def read_settings_values(path: Path) -> dict[str, object]:
    """Read a settings file as plain values, for options of a command to be laid over.

    Raises:
        SettingsError: The file is missing or is no TOML.
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        reason = error.strerror or type(error).__name__
        raise SettingsError(
            f"settings file {path} cannot be read ({reason.lower()}), expected a TOML file"
        ) from error
    except ValueError as error:
        raise SettingsError(f"settings file {path} is no TOML: {_first_line(error)}") from error


def parse_settings(values: Mapping[str, object], *, source: str) -> Settings:
    """Check plain values and give them as settings; `source` names where they come from.

    Raises:
        SettingsError: A key is unknown or a value bad.
    """
    try:
        return Settings.model_validate(values)
    except ValidationError as error:
        raise SettingsError(_describe(error, source)) from error


def _describe(error: ValidationError, source: str) -> str:
    """Say in one line what is wrong with the first key, and how many more there are."""
    # A misspelt key also makes the right one missing: the key is what helps.
    problems = sorted(error.errors(include_url=False), key=lambda e: e["type"] != _UNKNOWN)
    first = problems[0]
    keys, model = _resolve(first["loc"])
    name = ".".join(keys)
    if first["type"] == _UNKNOWN and model is not None:
        text = f"unknown setting {name!r}, expected {_nearest(keys[-1], model)}"
    else:
        message = first["msg"].removeprefix("Value error, ")
        given = first.get("input")
        found = f" (found {given!r})" if isinstance(given, str | int | float | bool) else ""
        text = f"setting {name!r}: {message[:1].lower()}{message[1:]}{found}"
    more = f" (and {len(problems) - 1} more)" if len(problems) > 1 else ""
    return f"{source}: {text}{more}"


def _resolve(location: tuple[int | str, ...]) -> tuple[list[str], type[BaseModel] | None]:
    """Give the keys of a location as the file has them, and the model that holds the last one.

    pydantic names the chosen member of a tagged union in the location; the file does not.
    """
    keys: list[str] = []
    kind: Any = Settings
    holder: type[BaseModel] | None = None
    for piece in location:
        member = _tagged_member(kind, piece)
        if member is not None:
            kind = member
            continue
        keys.append(str(piece))
        holder = kind if _is_model(kind) else None
        kind = _kind_below(kind, piece)
    return keys, holder


def _kind_below(kind: Any, piece: int | str) -> Any:
    """Give the declared type of one key or index of a declared type."""
    if _is_model(kind):
        field = kind.model_fields.get(piece)
        return None if field is None else field.annotation
    arguments = [argument for argument in get_args(kind) if argument is not Ellipsis]
    return arguments[-1] if arguments and get_origin(kind) in (dict, tuple, list) else None


def _tagged_member(kind: Any, piece: int | str) -> type[BaseModel] | None:
    if get_origin(kind) is Annotated:
        kind = get_args(kind)[0]
    if get_origin(kind) not in (Union, types.UnionType):
        return None
    for member in get_args(kind):
        if _is_model(member):
            tags = [
                field.default
                for field in member.model_fields.values()
                if get_origin(field.annotation) is Literal
            ]
            if piece in tags:
                return member
    return None


def _is_model(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, BaseModel)


def _nearest(key: str, model: type[BaseModel]) -> str:
    known = list(model.model_fields)
    near = difflib.get_close_matches(key, known, n=1, cutoff=0.5)
    return repr(near[0]) if near else f"one of {', '.join(known)}"


def _first_line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0]
