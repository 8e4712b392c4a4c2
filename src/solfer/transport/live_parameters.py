"""Requests and replies of the live parameters of a plugin."""

from dataclasses import dataclass

SET_PARAMETERS = "solfer/SetParameters"
"""Interface of `<plugin>/set_parameters`."""

GET_PARAMETERS = "solfer/GetParameters"
"""Interface of `<plugin>/get_parameters`."""


@dataclass(frozen=True)
class SetParameters:
    """New values of parameters, all of which count, or none.

    Attributes:
        names: Names of the parameters.
        values: Their values, in YAML; an empty one stands for the default.
    """

    names: tuple[str, ...] = ()
    values: tuple[str, ...] = ()


@dataclass(frozen=True)
class GetParameters:
    """Names of the parameters to describe; none: all."""

    names: tuple[str, ...] = ()


@dataclass(frozen=True)
class ParametersReply:
    """What `GetParameters` asks for: a text for each parameter; values in YAML, and empty where there is none."""

    success: bool = True
    message: str = ""
    names: tuple[str, ...] = ()
    types: tuple[str, ...] = ()
    values: tuple[str, ...] = ()
    defaults: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    minimums: tuple[str, ...] = ()
    maximums: tuple[str, ...] = ()
    descriptions: tuple[str, ...] = ()
