"""Checks of the parts of a configuration that no module uses: they may be incomplete, but not wrong."""

from solfer.config.loading.calibration import CalibrationRecord
from solfer.config.loading.library import CONTROLLER, FEEDBACK_SECTION, Library, named_records
from solfer.config.loading.reading import NOT_CONFIGURATIONS, Used, misspelt_key
from solfer.config.records.middlewares import MIDDLEWARES
from solfer.config.records.modules import MainRecord, RobotRecord
from solfer.config.records.record import parse
from solfer.config.records.sources import MappingRecord, SourceRecord
from solfer.config.yaml.nodes import YamlNode
from solfer.config.yaml.problems import Problems


def check_rest(tree: YamlNode, used: Used, problems: Problems) -> None:
    """Check robot configurations, sets, pipes, maps, calibrations and sources of a merged tree.

    Args:
        tree: The value of the root key.
        used: Pipes that modules use; these are checked with the modules, for the middleware that is chosen.
        problems: Receives the findings.
    """
    parse(tree, MainRecord, problems)
    named_records(tree.get("calibration"), CalibrationRecord, problems)
    chosen = tree.get("middleware")
    for middleware, kind in MIDDLEWARES.items():
        section = tree.get(kind.section)
        is_chosen = chosen is not None and chosen.value == middleware
        if is_chosen:
            _check_lists(tree, middleware, problems)
        named_records(section and section.get("mapping"), MappingRecord, problems)
        source = section and section.get("source")
        if source is not None:
            parse(source, SourceRecord, problems)
        for direction in (FEEDBACK_SECTION, CONTROLLER):
            _check_pipes(tree, middleware, direction, used=used if is_chosen else None, problems=problems)


def _check_lists(tree: YamlNode, middleware: str, problems: Problems) -> None:
    """Check robot configurations, and the pipes that they and the sets name."""
    libraries = {kind: Library(tree, middleware, kind, problems=problems) for kind in (FEEDBACK_SECTION, CONTROLLER)}
    for direction, library in libraries.items():
        sets = tree.get(f"{direction}s")
        for _, node in sets.items() if sets else ():
            library.check_list(library.list_of(node))
    robots = tree.get("robot")
    misspelt = misspelt_key(tree)
    for name, node in robots.items() if robots else ():
        if misspelt is not None and misspelt.where == str(node.head):
            problems.put(node.head, misspelt)
            continue
        if name in NOT_CONFIGURATIONS or parse(node, RobotRecord, problems, name="", configuration=name) is None:
            continue
        chosen = node.get("feedback", "layer")
        if chosen is None:
            libraries[FEEDBACK_SECTION].check_list(node.get("feedback", "list"))
        else:
            libraries[FEEDBACK_SECTION].check_set(chosen)


def _check_pipes(tree: YamlNode, middleware: str, direction: str, used: Used | None, problems: Problems) -> None:
    """Check each pipe, or without `used`, for a middleware that is not chosen, each pipe that its section names."""
    generic = tree.get(direction)
    special = tree.get(MIDDLEWARES[middleware].section, direction)
    for part in (special,) if used is None else (generic, special):
        for name, node in part.items() if part else ():
            found = Problems(complete=False)
            Library(tree, middleware, direction, problems=found).pipe(name, node.head)
            problems.absorb(found, notices=(direction, name) not in (used or ()))
