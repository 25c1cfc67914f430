"""The team package: graph, formation, pre-stabiliser."""
