"""What several draws of a log have in common."""

import math
from typing import Any

NORMALISED = ("anees_tilt", "anees_velocity", "anees_position", "anees_height", "anees_heading")
COMPARED = ("end_error", "heading_error", "ate")


def mean_normalised(lines: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return a line for each noise of the lines of a log: means of the filter's normalised squared errors."""
    made = []
    for noise in dict.fromkeys(line["noise"] for line in lines):
        draws = [line for line in lines if line["method"] == "filter" and line["noise"] == noise]
        first = draws[0]
        means = {key: round(sum(line[key] for line in draws) / len(draws), 3) for key in NORMALISED}
        kept = {key: first[key] for key in ("course", "seed", "noise", "transport") if key in first}
        made.append(kept | {"draws": len(draws)} | means)
    return made


def ratios(lines: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return a line for each noise of the lines of a log: by how much the filter errs more than the smoother (RMS)."""
    made = []
    for noise in dict.fromkeys(line["noise"] for line in lines):
        draws = [line for line in lines if line["noise"] == noise]
        ours, bounds = ([line for line in draws if line["method"] == name] for name in ("filter", "smoother"))
        if bounds:
            first = ours[0]
            made.append(
                {"course": first["course"], "method": "filter / smoother", "seed": first["seed"], "noise": noise}
                | {"draws": len(ours)}
                | {key: round(_rms(ours, key) / _rms(bounds, key), 3) for key in COMPARED}
            )
    return made


def _rms(lines: list[dict[str, Any]], key: str) -> float:
    return math.sqrt(sum(line[key] ** 2 for line in lines) / len(lines))
