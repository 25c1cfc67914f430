"""What a log holds: channels, fields and their protobuf messages, read and written by the same tables."""
