"""A run's log: tick records in, an MCAP file out, and the file back in as arrays.

schema   channels, fields, their protobuf messages
scene    what a viewer draws, in Foxglove's schemas
write    record -> messages -> chunks -> file
read     file -> checked MCAP records -> arrays
repair   a clean file of what a damaged one still holds
verify   the log's scenario run again and compared
live     the same messages over a WebSocket, while the run goes on
"""
