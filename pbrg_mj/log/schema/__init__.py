"""What a log holds; writer and readers share these tables.

channels -> fields (name, shape, unit of each value) -> protobuf (classes, encoder, decoder) -> message (bytes, times)

ending    why a log ends where it does: written behind its last tick
"""
