"""A network in the language of Graphviz.

The colours are those of the paper's figures: blue plugins with a green component, pink Robots, yellow sensors, lower
level and topics, a purple shared plugin.
"""

import os
from collections.abc import Iterator
from html import escape

from solfer_tools.cli.diagram.network import Arrow, End, Kind, Network, PluginBox

PINK = "#f8d3d8"
LINE_COLOR = "#3b4a5a"


def dot_text(network: Network) -> str:
    """Write a network in DOT, laid out from the sensors on the left to the lower level on the right."""
    fonts = "Helvetica,Arial,sans-serif"
    lines = [
        "digraph solfer {",
        f'  graph [rankdir=LR, bgcolor=white, fontname="{fonts}", fontsize=12, labeljust=l];',
        "  graph [nodesep=0.35, ranksep=0.5, pad=0.2];",
        f'  node [shape=plain, fontname="{fonts}", fontsize=11, color="{LINE_COLOR}"];',
        f'  edge [color="{LINE_COLOR}", arrowsize=0.8];',
        *_plugins(network),
        *_third_parties(network),
        *_arrows(network),
        "}",
    ]
    return "\n".join(lines) + "\n"


def _plugins(network: Network) -> Iterator[str]:
    boxes = {plugin.name: plugin for plugin in network.plugins}
    purple = "#e4daf5"
    for number, (name, groups) in enumerate(network.shared.items()):
        yield f"  subgraph cluster_{number} {{"
        yield _area(f"shared plugin {name}", purple)
        for count, members in enumerate(groups):
            yield f"  subgraph cluster_{number}_{count} {{"
            yield _area(_robot(boxes[members[0]]), PINK)
            yield from (f"  {_plugin(boxes.pop(member), own_robot=False)}" for member in members)
            yield "  }"
        yield "  }"
    yield from (f"  {_plugin(plugin)}" for plugin in boxes.values())


def _area(title: str, colour: str) -> str:
    return f'  label="{title}"; style="rounded,filled"; fillcolor="{colour}"; color="{LINE_COLOR}"; margin=12;'


def _plugin(plugin: PluginBox, own_robot: bool = True) -> str:
    """Write a blue box: name, the Robot in pink unless it is shared, the component in green and what it declares."""
    kind = f"{plugin.layer}, {plugin.rate:g} Hz" + (", idle" if plugin.idle else "")
    rows = [_row(f"<B>{escape(plugin.name)}</B>"), _row(_small(kind))]
    if own_robot:
        rows.append(_row(escape(_robot(plugin)), PINK))
    rows.append(_row(escape(plugin.component), "#d3ecc8"))  # green
    rows += [_row(_small(f"{one.kind} {one.name}")) for one in plugin.declared]
    blue = "#cfe2f7"
    return f"{_name(End(Kind.PLUGIN, plugin.name))} [label=<{_table(rows, blue)}>];"


def _third_parties(network: Network) -> Iterator[str]:
    """Write yellow boxes: sensors at one end, the lower level at the other, and topics outside of the picture."""
    system = {"SM": "simulation", "HW": "hardware"}.get(network.system, network.system)
    yellow = "#fff0b8"
    for kind, rank in ((Kind.SENSORS, "source"), (Kind.LOWER_LEVEL, "sink")):
        for end in network.ends(kind):
            rows = [_row(f"<B>{kind.value}</B>"), _row(_small(system))]
            yield f"  {{ rank={rank}; {_name(end)} [label=<{_table(rows, yellow)}>]; }}"
    for end in network.ends(Kind.TOPIC):
        rows = [_row(f"<B>{escape(end.name)}</B>"), _row(_small("topic"))]
        yield f"  {_name(end)} [label=<{_table(rows, yellow)}>];"


def _arrows(network: Network) -> Iterator[str]:
    """Write each text as a node between the ends of its arrows: Graphviz lays nothing over a node.

    What one sender sends to several receivers under one name stands there once.
    """
    groups: dict[tuple[End, bool, str, str, str], list[Arrow]] = {}
    for arrow in network.arrows:
        groups.setdefault((arrow.tail, arrow.idle, arrow.pipe, arrow.content, arrow.reference), []).append(arrow)
    areas = _areas(network)
    for number, ((tail, is_idle, pipe, *details), arrows) in enumerate(groups.items()):
        rows = [f"<B>{escape(pipe)}</B>", *(_small(each) for each in details if each)]
        cells = "".join(f'<TR><TD ALIGN="LEFT">{row}</TD></TR>' for row in rows)
        table = f'<TABLE BORDER="0" CELLBORDER="0" CELLSPACING="0" CELLPADDING="1">{cells}</TABLE>'
        text = f"text_{number}"
        node = f'{text} [label=<{table}>, fontsize=10, fontcolor="{LINE_COLOR}"];'
        around = os.path.commonprefix([areas.get(end, ()) for end in (tail, *(arrow.head for arrow in arrows))])
        yield f"  {''.join(f'subgraph {area} {{ ' for area in around)}{node}{' }' * len(around)}"
        style = 'style=dashed, color="gray"' if is_idle else ""
        yield f"  {_name(tail)} -> {text} [dir=none, {style}];"
        yield from (f"  {text} -> {_name(arrow.head)} [{style}];" for arrow in arrows)


def _areas(network: Network) -> dict[End, tuple[str, str]]:
    """Return the areas around each member of a shared plugin: that of the shared plugin, then that of the Robot."""
    return {
        End(Kind.PLUGIN, member): (f"cluster_{number}", f"cluster_{number}_{count}")
        for number, groups in enumerate(network.shared.values())
        for count, members in enumerate(groups)
        for member in members
    }


def _table(rows: list[str], colour: str) -> str:
    style = f'STYLE="ROUNDED" BORDER="1" CELLBORDER="0" CELLSPACING="4" CELLPADDING="4" BGCOLOR="{colour}"'
    return f'<TABLE {style} COLOR="{LINE_COLOR}">{"".join(rows)}</TABLE>'


def _row(text: str, colour: str = "") -> str:
    fill = f' BGCOLOR="{colour}" STYLE="ROUNDED" CELLPADDING="6"' if colour else ' CELLPADDING="1"'
    return f"<TR><TD{fill}>{text}</TD></TR>"


def _small(text: str) -> str:
    grey = "#68778a"
    return f'<FONT POINT-SIZE="9" COLOR="{grey}">{escape(text)}</FONT>'


def _robot(plugin: PluginBox) -> str:
    return f"Robot {plugin.model}"


def _name(end: End) -> str:
    escaped = str(end).replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'
