"""Options of parts of other packages: the pydantic model that a build function asks for, and what fits it."""

from __future__ import annotations

import inspect
import json
from collections.abc import Callable, Mapping
from typing import Any, get_type_hints

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from pbrg_mj.errors import PlugInError


def options_model(build: Callable[..., Any]) -> type[BaseModel] | None:
    """Return the pydantic model of a build function's parameter `options`; None if it takes none.

    Raises PlugInError when that parameter is not annotated with a model.
    """
    if "options" not in parameters(build):
        return None
    function = build.__init__ if isinstance(build, type) else build
    try:
        model = get_type_hints(function).get("options")
    except Exception as error:
        raise PlugInError(f"the annotations of {build!r} cannot be read: {error}") from error
    if not (isinstance(model, type) and issubclass(model, BaseModel)):
        raise PlugInError(f"the parameter `options` of {build!r} is not annotated with a pydantic model")
    return model


def option_keys(model: type[BaseModel]) -> dict[str, FieldInfo]:
    """Return a model's fields by the keys they have in YAML."""
    return {field.alias or name: field for name, field in model.model_fields.items()}


def unknown_options(model: type[BaseModel], options: Mapping[str, Any]) -> list[str]:
    """Return the keys that no field of the model has, unless the model says that it allows any."""
    open_ended = model.model_config.get("extra") == "allow"
    return [] if open_ended else [key for key in options if key not in option_keys(model)]


def validated(model: type[BaseModel], options: Mapping[str, Any]) -> BaseModel:
    """Return a model of options as YAML or JSON has them: no text for a number.

    Raises ValidationError, and PlugInError when the model's own code fails.
    """
    try:
        return model.model_validate_json(json.dumps(options), strict=True)
    except ValidationError:
        raise
    except Exception as error:
        raise PlugInError(f"{model.__name__}: the options' model raised {type(error).__name__}: {error}") from error


def parameters(build: Callable[..., Any]) -> Mapping[str, inspect.Parameter]:
    """Return a function's parameters by name, none where they cannot be told."""
    try:
        return inspect.signature(build).parameters
    except (TypeError, ValueError):  # some compiled functions have none
        return {}
