"""Services of live parameters, which every plugin offers."""

from dataclasses import dataclass

GET_PARAMETERS = "get_parameters"
"""Name of the service that describes parameters, behind that of the plugin."""

GET_INTERFACE = "solfer/GetParameters"
"""Its interface."""

SET_PARAMETERS = "set_parameters"
"""Name of the service that changes parameters, behind that of the plugin."""

SET_INTERFACE = "solfer/SetParameters"
"""Its interface."""


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
    """What `GetParameters` requests: a text for each parameter; values in YAML, and empty where there is none.

    Attributes:
        configured: The values that the plugin was made with.
    """

    success: bool = True
    message: str = ""
    names: tuple[str, ...] = ()
    types: tuple[str, ...] = ()
    values: tuple[str, ...] = ()
    configured: tuple[str, ...] = ()
    defaults: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    minimums: tuple[str, ...] = ()
    maximums: tuple[str, ...] = ()
    descriptions: tuple[str, ...] = ()
