"""A network as plain text."""

from collections.abc import Iterator

from solfer.cli.columns import aligned
from solfer_tools.cli.diagram.network import Arrow, End, Kind, Network, PluginBox


def plain_text(network: Network) -> str:
    """List what each plugin receives and sends, with the other end of each pipe."""
    return "\n".join(line for plugin in network.plugins for line in _lines(plugin, network))


def _lines(plugin: PluginBox, network: Network) -> Iterator[str]:
    mode = ", idle: commands nothing" if plugin.idle else ""
    yield f"{plugin.name}: {plugin.component} on Robot {plugin.model} ({plugin.robot})"
    yield f"  {plugin.layer}, {plugin.rate:g} Hz{mode}{_sharing(plugin.name, network)}"
    pipes = (arrow for arrow in network.arrows if plugin.name in (_plugin(arrow.tail), _plugin(arrow.head)))
    rows = [_cells(plugin.name, arrow) for arrow in pipes]
    rows.sort(key=lambda row: row[0])
    rows += [("declares", one.kind, one.name, one.interface) for one in plugin.declared]
    yield from aligned(rows, indent="  ")
    yield ""


def _plugin(end: End) -> str | None:
    return end.name if end.kind is Kind.PLUGIN else None


def _sharing(name: str, network: Network) -> str:
    for shared, groups in network.shared.items():
        for members in groups:
            others = [member for member in members if member != name]
            if len(others) < len(members):
                robot = f", one Robot with {', '.join(others)}" if others else ""
                return f", in shared plugin {shared}{robot}"
    return ""


def _cells(name: str, arrow: Arrow) -> tuple[str, ...]:
    receives = _plugin(arrow.head) == name
    other = f"from {arrow.tail}" if receives else f"to {arrow.head}"
    return "receives" if receives else "sends", arrow.pipe, arrow.content, arrow.reference, other, arrow.topic
