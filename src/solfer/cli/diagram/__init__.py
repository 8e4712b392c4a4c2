"""Plugins, their Robots and their pipes as a picture, as in Figs. 1 to 5 of the paper."""

from solfer.cli.diagram.connection import connect
from solfer.cli.diagram.dot import dot_text
from solfer.cli.diagram.drawing import draw
from solfer.cli.diagram.network import Network
from solfer.cli.diagram.text import plain_text

__all__ = ["Network", "connect", "dot_text", "draw", "plain_text"]
