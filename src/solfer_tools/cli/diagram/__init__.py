"""Plugins, their Robots and their pipes as a picture, as in Figs. 1 to 5 of the paper."""

from solfer_tools.cli.diagram.connection import connect, network_of
from solfer_tools.cli.diagram.dot import dot_text
from solfer_tools.cli.diagram.drawing import draw
from solfer_tools.cli.diagram.network import Network
from solfer_tools.cli.diagram.text import plain_text

__all__ = ["Network", "connect", "dot_text", "draw", "network_of", "plain_text"]
