"""Meshes in COLLADA, written for a test."""

from itertools import product

SIZE = (1.0, 2.0, 3.0)
"""Size of the box of `COLLADA`, in its unit."""

_SIDES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
_NUMBERS = " ".join(f"{x} {y} {z}" for x, y, z in product(*((-0.5 * size, 0.5 * size) for size in SIZE)))
_TRIANGLES = " ".join(f"{a} {b} {c} {a} {c} {d}" for a, b, c, d in _SIDES)

COLLADA = f"""<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><!-- <unit meter="7"/> --><unit name="own" meter="{{unit}}"/><up_axis>Z_UP</up_axis></asset>
<library_geometries><geometry id="box" name="box"><mesh>
<source id="corners"><float_array id="numbers" count="24">{_NUMBERS}</float_array>
<technique_common><accessor source="#numbers" count="8" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="vertices"><input semantic="POSITION" source="#corners"/></vertices>
<triangles count="12"><input semantic="VERTEX" source="#vertices" offset="0"/>
<p>{_TRIANGLES}</p></triangles></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="scene"><node id="node"><instance_geometry url="#box"/></node></visual_scene>
</library_visual_scenes><scene><instance_visual_scene url="#scene"/></scene></COLLADA>
"""
"""A box, with the length of a unit [m] as text."""
