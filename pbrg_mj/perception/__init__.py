"""The perception room: scans to lines to half-spaces."""
