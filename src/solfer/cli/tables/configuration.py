"""Parts of a main configuration: its modules and pipes, and the plugins for them."""

import argparse
from collections.abc import Iterator

from solfer.cli.pipes import content, received, topic_of
from solfer.cli.plugins import component_of, configurations_of, declared_by, report_of
from solfer.config import AnyPipeRecord, CheckReport, Configuration, ControllerRecord, FeedbackRecord, MappingRecord
from solfer.config.loading.library import CONTROLLER, FEEDBACK
from solfer.config.records.middlewares import MIDDLEWARES
from solfer.plugins.generation.registry import Registry
from solfer.robot.defaults import MODEL_MAPS
from solfer.robot.names import FEEDBACK_MAP as FEEDBACK_MAP
from solfer.robot.names import LOWER_LEVEL_MAP, controller_map

Row = tuple[str, ...]


def configs(options: argparse.Namespace) -> Iterator[Row]:
    """List component, layer, robot configuration, controller pipes, and mode if it is not `full`."""
    report = report_of(options)
    for name in report.modules:
        if name in report.shared:
            yield name, "shared plugin", ", ".join(report.shared[name].record.plugins)
        elif name in report.configurations:
            yield _config(report.configurations[name])
        else:
            yield name, "cannot be used: see `solfer check`"


def _config(configuration: Configuration) -> Row:
    module = configuration.module
    chosen = configuration.module.controller
    controller = chosen if isinstance(chosen, str) else f"[{', '.join(chosen)}]"
    mode = "idle" if module.mode == "idle" else ""
    pipes = f"robot {module.robot}", f"controller {controller}"
    return module.name, component_of(configuration), module.layer, *pipes, mode


def pipes(options: argparse.Namespace) -> Iterator[Row]:
    """List direction, content, DoFs, map, topic, and the configurations that use the pipe."""
    report = report_of(options)
    users: dict[tuple[str, str], list[str]] = {}
    records: dict[tuple[str, str], AnyPipeRecord] = {}
    for configuration in configurations_of(report):
        both: tuple[AnyPipeRecord, ...] = (*received(configuration), *configuration.controllers)
        for record in both:
            key = _direction(record), record.name
            users.setdefault(key, []).append(configuration.module.name)
            records.setdefault(key, record)
    for key, record in sorted(records.items(), key=lambda item: (item[0][0] != FEEDBACK, item[0][1])):
        names = users[key]
        yield (
            *_pipe(record),
            f"used by {', '.join(names) if len(names) <= 3 else f'{len(names)} configurations'}",
        )
    if options.name is None:
        yield from ((name, direction, "used by nothing") for direction, name in _unused(report, records))


def _pipe(record: AnyPipeRecord) -> Row:
    part = () if record.dofs is None else (record.dofs.chain, record.dofs.type)
    about = (*(part or ("", "")), record.refers_to, topic_of(record))
    return record.name, _direction(record), record.space, content(record), *about


def _direction(record: AnyPipeRecord) -> str:
    return CONTROLLER if isinstance(record, ControllerRecord) else FEEDBACK


def _unused(report: CheckReport, used: dict[tuple[str, str], AnyPipeRecord]) -> list[tuple[str, str]]:
    """Return direction and name of the pipes that the file describes and no configuration uses."""
    tree = next((each.tree for each in configurations_of(report)), None)
    libraries = {direction: tree and tree.get(direction) for direction in (FEEDBACK, CONTROLLER)}
    named = [(direction, name) for direction, node in libraries.items() if node for name, _ in node.items()]
    return [key for key in named if key not in used]


def plugins(options: argparse.Namespace) -> Iterator[Row]:
    """List the default configuration of each plugin, and what its component does; those of a file have a `class:`."""
    registry = Registry()
    for name in registry.names():
        yield name, f"configuration {registry.configuration(name)}", registry.describe(name)
    if options.file is not None:
        for configuration in configurations_of(report_of(options)):
            if configuration.module.class_ is not None:
                yield configuration.module.name, "configuration of its own", f"class {configuration.module.class_}"


def maps(options: argparse.Namespace) -> Iterator[Row]:
    """List what each bidirectional map has at its outer end; the inner one is always the model of its plugin."""
    found = dict.fromkeys(MODEL_MAPS, "the model itself: identity")
    found["ACTUATED"] = "the DoFs with a drive"
    for configuration in configurations_of(report_of(options)):
        for name, text in _own_maps(configuration):
            found.setdefault(name, text)
    yield from found.items()


def _own_maps(configuration: Configuration) -> Iterator[Row]:
    middleware = MIDDLEWARES[configuration.middleware]
    if middleware.map is not None:
        yield middleware.map, f"the order of {middleware.title}"
    for name, record in configuration.mappings.items():
        if record.loading == "topic":
            yield name, _first_message(record)
        else:
            yield name, f"model {record.urdf.parameter or record.urdf.location}"
    for feedback in configuration.feedbacks:
        if feedback.measures_joints and feedback.source:
            yield FEEDBACK_MAP, _first_message(feedback)
    for controller in configuration.controllers:
        if controller.lower_level:
            yield controller_map(controller.leads_to), f"controller {controller.leads_to} of the lower level"
            yield LOWER_LEVEL_MAP, "all controllers of the lower level that the plugin commands"


def _first_message(record: FeedbackRecord | MappingRecord) -> str:
    of = f" ({record.message})" if record.message else ""
    return f"topic {record.source}{of}: order of its first message"


def declarations(options: argparse.Namespace) -> Iterator[Row]:
    """List services, topics, actions and parameters of the components, each with its interface and its plugin."""
    for configuration in configurations_of(report_of(options)):
        for one in declared_by(configuration):
            yield one.name, one.kind, one.interface, f"of {configuration.module.name}"


TABLES = {"configs": configs, "declarations": declarations, "maps": maps, "pipes": pipes, "plugins": plugins}
