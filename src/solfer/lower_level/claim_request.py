"""What a request for a claim means."""

from collections.abc import Mapping

import numpy as np

from solfer.errors import CommandRefused, UnknownName
from solfer.lower_level.claims import MODES, Wanted
from solfer.lower_level.controller import Controller
from solfer.pipes.lower_level import ClaimRequest


def wanted(controllers: Mapping[str, Controller], request: ClaimRequest) -> list[Wanted]:
    """The joints and fields that a request claims.

    Raises:
        UnknownName: A controller, a field or a joint does not exist.
        CommandRefused: The request names no owner, no controller, or a field that its controller does not take.
    """
    if not request.owner or not request.controllers:
        raise CommandRefused("a claim without an owner or without controllers")
    for name in request.controllers:
        if name not in controllers:
            raise UnknownName("controller", name, controllers)
    fields = _fields(controllers, request)
    known = [joint for name in fields for joint in controllers[name].joints]
    for joint in request.joints:
        if joint not in known:
            raise UnknownName("joint", joint, known, expected=f"joints of {', '.join(fields)}")
    chosen = set(request.joints or known)
    return [Wanted(name, _places(controllers[name], chosen), modes) for name, modes in fields.items()]


def _fields(controllers: Mapping[str, Controller], request: ClaimRequest) -> dict[str, tuple[str, ...]]:
    """The fields that are claimed of each controller."""
    if not request.modes:
        return {name: controllers[name].FIELDS for name in request.controllers}
    if len(request.modes) != len(request.controllers):
        raise CommandRefused(f"{len(request.modes)} modes for {len(request.controllers)} controllers",
                             expected="one for each, or none at all")
    fields: dict[str, tuple[str, ...]] = {}
    for name, mode in zip(request.controllers, request.modes, strict=True):
        taken = controllers[name].FIELDS
        if mode not in MODES:
            raise UnknownName("mode", mode, taken)
        if mode not in taken:
            raise CommandRefused(f"controller '{name}' does not take '{mode}'",
                                 expected=f"one or more of {', '.join(taken)}")
        fields[name] = (*fields.get(name, ()), mode)
    return fields


def _places(controller: Controller, chosen: set[str]) -> np.ndarray:
    return np.array([index for index, joint in enumerate(controller.joints) if joint in chosen], dtype=np.intp)
