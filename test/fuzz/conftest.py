"""The fixtures of the tests of nodes serve here too."""

from __future__ import annotations

from nodes_room import nodes

make_world, world = nodes.make_world, nodes.world
wire, scenario_file = nodes.wire, nodes.scenario_file
