"""Robots' programs in processes of their own, which talk over UDP: the benchmark's world is on the other side.

schema      what is on the wire: protobuf messages, and their .proto text
address     where a process is
datagrams   data of robots' programs as such messages, and back
mailbox     a socket, on the loopback interface unless another one is asked for
robot       the process of one robot
team        the world's side: a governor whose answers come from processes
child       that process, as the world starts it
children    starts such processes and ends them
"""
