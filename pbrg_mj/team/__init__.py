"""The team room: graph, formation, pre-stabiliser."""
