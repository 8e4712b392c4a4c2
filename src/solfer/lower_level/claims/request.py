"""Resolves a request for a claim."""

import math
from collections.abc import Mapping

import numpy as np

from solfer.errors import CommandRefused, UnknownName
from solfer.lower_level.claims.claims import MODES, ClaimedJoints
from solfer.lower_level.laws.controllers import LowerLevelController
from solfer.transport.lower_level import ClaimRequest


def requested(controllers: Mapping[str, LowerLevelController], request: ClaimRequest) -> list[ClaimedJoints]:
    """Resolve the joints and fields that a request claims.

    Raises:
        UnknownName: A controller, a field or a joint does not exist.
        CommandRefused: The request names no owner, no controller, or a field that its controller does not accept.
    """
    if not request.owner or not request.controllers:
        raise CommandRefused(
            "a claim without an owner or without controllers",
            expected="the name of the plugin and at least one controller",
        )
    for name in request.controllers:
        if name not in controllers:
            raise UnknownName("controller", name, controllers)
    fields = _fields(controllers, request)
    known = dict.fromkeys(joint for name in fields for joint in controllers[name].joints)
    for joint in request.joints:
        if joint not in known:
            raise UnknownName("joint", joint, known, expected=f"joints of {', '.join(fields)}")
    chosen = set(request.joints or known)
    return [
        ClaimedJoints(name, np.flatnonzero([joint in chosen for joint in controllers[name].joints]), modes)
        for name, modes in fields.items()
    ]


def measured(request: ClaimRequest) -> dict[str, float]:
    """Return where the owner of a request measures joints [rad, m].

    Raises:
        CommandRefused: There is not one position for each joint.
    """
    if len(request.positions) not in (0, len(request.joints)):
        raise CommandRefused(
            f"{len(request.positions)} positions for {len(request.joints)} joints", expected="one for each, or none"
        )
    return {
        joint: position
        for joint, position in zip(request.joints, request.positions, strict=False)
        if math.isfinite(position)
    }


def _fields(controllers: Mapping[str, LowerLevelController], request: ClaimRequest) -> dict[str, tuple[str, ...]]:
    """Resolve the fields that are claimed of each controller."""
    if not request.modes:
        return {name: controllers[name].FIELDS for name in request.controllers}
    if len(request.modes) != len(request.controllers):
        raise CommandRefused(
            f"{len(request.modes)} modes for {len(request.controllers)} controllers",
            expected="one for each, or none",
        )
    fields: dict[str, tuple[str, ...]] = {}
    for name, mode in zip(request.controllers, request.modes, strict=True):
        accepted = controllers[name].FIELDS
        if mode not in MODES:
            raise UnknownName("mode", mode, accepted)
        if mode not in accepted:
            raise CommandRefused(
                f"controller '{name}' does not accept '{mode}'", expected=f"one or more of {', '.join(accepted)}"
            )
        fields[name] = (*fields.get(name, ()), mode)
    return fields
